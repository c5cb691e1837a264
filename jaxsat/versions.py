"""Versions of the software that numbers depend on."""

import platform
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("jaxsat", "jax", "jaxlib", "equinox", "numpy", "pyerfa")
"""What results depend on."""
LAST_DIGITS = ("jaxsat", "jax", "jaxlib", "numpy")
"""What the last digits of a sweep depend on."""


def versions(packages: Sequence[str] = PACKAGES) -> dict[str, str]:
    """Versions of Python and of installed packages, by their names."""
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
