"""Where light from a spherical Earth is asked for at or below its ground."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import safe_norm

_LEAST_HEIGHT = 1e-6
"""In radii, 6 m above the Earth: at the sphere itself the geometry of a satellite's view loses its sense."""


def above_ground(position: Float[Array, "3"], radius: float | Float[Array, ""]) -> Float[Array, "3"]:
    """Return the position itself, or the place just above the ground over one that is below it [as `radius`].

    So what light there is at the ground holds below it: an orbit that dips into the sphere, as one may over the
    flattened poles, has no gap. Over the centre, which is below every place, the x axis stands.
    """
    distance = safe_norm(position)
    least = radius * (1.0 + _LEAST_HEIGHT)
    somewhere = jnp.zeros_like(position).at[0].set(1.0)
    vertical = jnp.where(distance > 0.0, position / jnp.where(distance > 0.0, distance, 1.0), somewhere)
    return jnp.where(distance >= least, position, least * vertical)
