"""JAX as the command needs it: the precision of numbers, the device, and compiled programs kept between runs."""

import os
import sys
import warnings
from pathlib import Path
from typing import Literal

from jaxsat.errors import InputError

Precision = Literal["float64", "float32"]
Device = Literal["cpu", "gpu"]
_begun: list[Precision] = []
"""The precision of this process, once it has one."""


def set_up_jax(precision: Precision = "float64", device: Device | None = None) -> str | None:
    """Imports JAX, sets precision, device and a compile cache kept on disk; returns a notice where none can be kept.

    A process has one precision as long as it lives: what was tabulated and compiled in the other must not be met again.
    Without a device JAX takes a GPU where it finds one. Raises `InputError` for a second precision, and for a device
    that JAX does not find.

    The cache is $JAX_COMPILATION_CACHE_DIR if set, otherwise jaxsat/xla below $XDG_CACHE_HOME or ~/.cache. It holds
    nothing but compiled programs and may be deleted at any time.
    """
    directory = _cache_directory()
    problem = _why_not_writable(directory)

    import jax

    if _begun and _begun[0] != precision:
        raise InputError(f"this process works in {_begun[0]} already; begin another one", field=precision)
    _begun[:] = [precision]
    jax.config.update("jax_enable_x64", precision == "float64")
    if precision == "float32":
        # Whoever asks for it by name in a program knows what he gets.
        warnings.filterwarnings("ignore", "Explicitly requested dtype", UserWarning)
    if device is not None:
        _take(device)
    if problem:
        jax.config.update("jax_enable_compilation_cache", False)
        return f"no compile cache, every run compiles anew: {directory}: {problem}"
    _keep_in(directory)
    return None


def keep_programs(directory: str | Path | None = None) -> Path:
    """Keeps compiled programs between runs, as the command does, for a program of one's own; returns where.

    That is the given directory, else the one of `set_up_jax`, which this does without its choice of precision. To be
    called before the first program is compiled. Raises `InputError` for a directory that cannot be written.
    """
    place = _cache_directory() if directory is None else Path(directory)
    problem = _why_not_writable(place)
    if problem:
        raise InputError(f"no programs can be kept here: {problem}", file=place)
    _keep_in(place)
    return place


def _keep_in(directory: Path) -> None:
    import jax

    jax.config.update("jax_compilation_cache_dir", str(directory))
    # By default only slow compilations of large programs are kept; a cold start has many small ones.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def device_name() -> str:
    """The device that numbers are computed on, as `cpu` or `gpu NVIDIA H200`."""
    jax = sys.modules.get("jax")
    if jax is None:
        return "cpu"
    kind, platform = jax.devices()[0].device_kind, jax.default_backend()
    return platform if kind == platform else f"{platform} {kind}"


def _take(device: Device) -> None:
    import jax

    if device == "cpu":
        jax.config.update("jax_platforms", "cpu")
    found = jax.default_backend()
    if found != device:
        hint = "; JAX has to be installed for it, and JAX_PLATFORMS must not be cpu" if device == "gpu" else ""
        raise InputError(f"JAX finds none, and would take {found}{hint}", field=f"device {device}")


def _cache_directory() -> Path:
    own = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if own:
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path(os.path.expanduser("~")) / ".cache") / "jaxsat" / "xla"


def _why_not_writable(directory: Path) -> str | None:
    import tempfile  # Takes longer than all the rest of this module, which every command imports.

    try:
        # What lies there is run, so it is the user's alone.
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            return None
    except OSError as error:
        return error.strerror or str(error)
