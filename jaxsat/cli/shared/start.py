"""What a command does before numbers: JAX set up, with a word where no compile cache can be kept."""

import sys


def start_jax() -> None:
    """Sets JAX up as `jaxsat.numerics.set_up_jax` does; its notice goes to stderr."""
    from jaxsat.numerics import set_up_jax

    notice = set_up_jax()
    if notice:
        print(f"jaxsat: {notice}", file=sys.stderr)
