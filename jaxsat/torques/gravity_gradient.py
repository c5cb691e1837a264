"""Gravity-gradient torque of a point-mass Earth."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_MU
from jaxsat.math import cross
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment


def gravity_gradient_torque(
    position_body: Float[Array, "3"],
    inertia: Float[Array, "3 3"],
    mu: float | Float[Array, ""] = EARTH_MU,
    *,
    distance: Float[Array, ""] | None = None,
) -> Float[Array, "3"]:
    """3 mu / r^3 (e x J e) [N m], e the direction from the Earth's centre (Wertz 1978, eq. 17-33).

    It turns the axis of least inertia toward the vertical. `distance` is r where it is known already.
    """
    r = jnp.sqrt(position_body @ position_body) if distance is None else distance
    return 3.0 * mu / (r * r * r * r * r) * cross(position_body, inertia @ position_body)


class GravityGradient(AbstractTorque):
    """Gravity gradient of a point-mass Earth."""

    smooth: ClassVar[bool] = True

    mu: float | Float[Array, ""] = EARTH_MU
    """Gravitational parameter [m^3/s^2]."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        return gravity_gradient_torque(around.position_body, spacecraft.inertia, self.mu, distance=around.distance)
