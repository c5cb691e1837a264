"""JAX as the command needs it: 64-bit numbers and compiled programs kept between runs."""

import os
import tempfile
from pathlib import Path


def set_up_jax() -> str | None:
    """Imports JAX, switches to float64 and a compile cache kept on disk; returns a notice where no cache can be kept.

    The cache is $JAX_COMPILATION_CACHE_DIR if set, otherwise jaxsat/xla below $XDG_CACHE_HOME or ~/.cache. It holds
    nothing but compiled programs and may be deleted at any time.
    """
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


def _cache_directory() -> Path:
    own = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if own:
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path(os.path.expanduser("~")) / ".cache") / "jaxsat" / "xla"


def _why_not_writable(directory: Path) -> str | None:
    try:
        # What lies there is run, so it is the user's alone.
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=directory):
            return None
    except OSError as error:
        return error.strerror or str(error)
