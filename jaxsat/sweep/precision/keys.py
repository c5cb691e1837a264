"""Random keys that draw the same numbers in single precision as in double, rounded.

JAX makes a number of 32 bits from a word of 32 bits and one of 64 from two words, and the single word is not one of the
two: case K would be another case. These keys take the upper bits of the two words, so that what is uniform, and what is
made of it, as `jax.random.normal`, is that of double precision to the last digits of single precision.
"""

import functools
import math
from typing import Any


def key_of(seed: int) -> Any:
    """JAX's key of a seed; where JAX works in single precision, one that draws what double precision draws, rounded."""
    import jax

    if jax.config.read("jax_enable_x64"):
        return jax.random.key(seed)
    return jax.random.key(seed, impl=_rounded())


@functools.cache
def _rounded() -> Any:
    """JAX's own generator (Salmon et al. 2011) but for words of 32 bits."""
    import jax.numpy as jnp
    from jax import lax
    from jax.extend import random

    own: Any = random.threefry_prng_impl

    def bits(key, width, shape):
        if width != 32:
            return own.random_bits(key, width, shape)
        count = lax.iota(jnp.uint32, math.prod(shape)).reshape(shape)
        upper, lower = random.threefry2x32_p.bind(key[0], key[1], jnp.zeros_like(count), count)
        # A mantissa has 23 bits and leaves the last ones, of which small whole numbers are made.
        return (upper & jnp.uint32(0xFFFFFF00)) | (lower & jnp.uint32(0xFF))

    return random.define_prng_impl(
        key_shape=(2,),
        seed=own.seed,
        split=own.split,
        random_bits=bits,
        fold_in=own.fold_in,
        name="threefry2x32_rounded",
        tag="frd",
    )
