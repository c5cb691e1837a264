"""Numbers and arrays at the door of a module."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float


def float_array(x: ArrayLike | Sequence) -> Float[Array, "..."]:
    """`x` as a floating array of the default precision; a converter for fields of modules.

    Plain numbers go through NumPy: converted by JAX, each would compile a program of its own.
    """
    return jnp.asarray(x, float) if isinstance(x, jax.Array) else jnp.asarray(np.asarray(x, dtype=float))


def optional_array(x: ArrayLike | Sequence | None) -> Float[Array, "..."] | None:
    """`float_array` of what may be absent."""
    return None if x is None else float_array(x)
