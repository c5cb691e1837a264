"""Lines of a magnetic field, for pictures of it."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment.magnetic import AbstractMagneticField
from jaxsat.math import unit

STEP_OVER_DISTANCE = 0.03
"""Step of the midpoint rule over the distance from the Earth's centre: 1e-3 of a dipole's L over a whole line."""
FURTHEST = 6.0 * EARTH_RADIUS_MEAN
"""Distance from the Earth's centre where a line is given up [m]."""


def field_line(
    field: AbstractMagneticField,
    position_ecef: Float[Array, "3"],
    *,
    steps: int = 120,
    radius: float | Float[Array, ""] = EARTH_RADIUS_MEAN,
) -> Float[Array, "points 3"]:
    """Return 2 `steps` + 1 points [m] of the field line through an Earth-fixed position, against the field first.

    dr/ds = +-B/|B| by the midpoint rule; the line ends on the sphere of `radius` [m] or at `FURTHEST`, and its last
    point is repeated from there on. The middle point is the position.
    """

    def half(sign):
        def step(r, _):
            h = sign * STEP_OVER_DISTANCE * jnp.linalg.norm(r)
            following = r + h * unit(field(r + 0.5 * h * unit(field(r))))
            # From inside to the sphere along the radius: the miss is a fraction of a step.
            landed = jnp.linalg.norm(following) < radius
            following = jnp.where(landed, radius * unit(following), following)
            distance = jnp.linalg.norm(r)
            r = jnp.where((distance <= radius * (1.0 + 1e-9)) | (distance >= FURTHEST), r, following)
            return r, r

        return jax.lax.scan(step, position_ecef, None, length=steps)[1]

    return jnp.concatenate([half(-1.0)[::-1], position_ecef[None], half(1.0)])
