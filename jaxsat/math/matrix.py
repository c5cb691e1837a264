"""Small dense matrices without a LAPACK call."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math.vector import cross


def inverse_3x3(matrix: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """Inverse by the adjugate: a handful of products that vectorise over a batch, where LU would loop over it."""
    a, b, c = matrix[0], matrix[1], matrix[2]
    bc = cross(b, c)
    return jnp.stack([bc, cross(c, a), cross(a, b)], axis=1) / (a @ bc)
