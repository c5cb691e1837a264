"""JAX as the command needs it: 64-bit numbers and compiled programs kept between runs."""

import os
import tempfile
from importlib.metadata import version
from pathlib import Path

TRIED = ("0", "10")
"""Version of JAX with which `choose_code_generator` was tried: the choice is of XLA's inside, not of its interface."""


def set_up_jax() -> str | None:
    """Imports JAX, switches to float64 and a compile cache kept on disk; returns a notice where no cache can be kept.

    The cache is $JAX_COMPILATION_CACHE_DIR if set, otherwise jaxsat/xla below $XDG_CACHE_HOME or ~/.cache. It holds
    nothing but compiled programs and may be deleted at any time.
    """
    choose_code_generator()
    directory = _cache_directory()
    problem = _why_not_writable(directory)

    import jax

    jax.config.update("jax_enable_x64", True)
    if problem:
        jax.config.update("jax_enable_compilation_cache", False)
        return f"no compile cache, every run compiles anew: {directory}: {problem}"
    jax.config.update("jax_compilation_cache_dir", str(directory))
    # By default only slow compilations of large programs are kept; a cold start has many small ones.
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    return None


def choose_code_generator() -> None:
    """Has XLA write a CPU's code in its older way, if nothing is compiled yet; $XLA_FLAGS may say otherwise.

    The programs are as fast, their numbers the same to rounding, and they take half of the processor time to compile:
    the newer way runs a compiler of its own for each of the hundreds of small loops of a step.
    """
    name, flags = "--xla_cpu_use_fusion_emitters", os.environ.get("XLA_FLAGS", "")
    # XLA ends a process that gives it a flag which it does not know.
    if tuple(version("jax").split(".")[:2]) == TRIED and name not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {name}=false".strip()


def _cache_directory() -> Path:
    own = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if own:
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path(os.path.expanduser("~")) / ".cache") / "jaxsat" / "xla"


def _why_not_writable(directory: Path) -> str | None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            return None
    except OSError as error:
        return error.strerror or str(error)
