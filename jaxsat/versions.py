"""The versions of what numbers depend on."""

import platform
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("jaxsat", "jax", "jaxlib", "equinox", "numpy", "pyerfa")


def versions(packages: tuple[str, ...] = PACKAGES) -> dict[str, str]:
    """Returns the versions of Python and of packages."""
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
