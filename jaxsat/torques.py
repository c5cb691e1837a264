"""Torques on a rigid satellite, in body axes: pure functions, and thin objects that are summed by the dynamics."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_MU
from jaxsat.math import cross
from jaxsat.spacecraft import Spacecraft


class BodyEnvironment(eqx.Module):
    """What surrounds the satellite at one instant, in body axes."""

    position_body: Float[Array, "3"]
    """From the Earth's centre to the satellite [m]."""
    b_field_body: Float[Array, "3"]
    """Magnetic flux density [T]."""
    angular_velocity: Float[Array, "3"]
    """Of the body against inertial space [rad/s]."""


def gravity_gradient_torque(
    position_body: Float[Array, "3"], inertia: Float[Array, "3 3"], mu: float | Float[Array, ""] = EARTH_MU
) -> Float[Array, "3"]:
    """3 mu / r^3 (e x J e) [N m], e the direction from the Earth's centre (Wertz 1978, eq. 17-33).

    It turns the axis of least inertia toward the vertical.
    """
    r2 = position_body @ position_body
    return 3.0 * mu / (r2 * r2 * jnp.sqrt(r2)) * cross(position_body, inertia @ position_body)


def magnetic_torque(dipole: Float[Array, "3"], b_field_body: Float[Array, "3"]) -> Float[Array, "3"]:
    """m x B [N m]: it turns the dipole toward the field (Jackson 1999, eq. 5.71)."""
    return cross(dipole, b_field_body)


class AbstractTorque(eqx.Module):
    """A torque that depends on the satellite and on what surrounds it."""

    @abstractmethod
    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        """Torque about the centre of mass, body axes [N m]."""


class GravityGradient(AbstractTorque):
    """Gravity gradient of a point-mass Earth."""

    mu: float = EARTH_MU

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        return gravity_gradient_torque(around.position_body, spacecraft.inertia, self.mu)


class PermanentMagnet(AbstractTorque):
    """Torque on the satellite's permanent dipole."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        return magnetic_torque(spacecraft.magnet, around.b_field_body)


class LinearRodsTorque(AbstractTorque):
    """Torque on the moment that the field induces in the rods."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        return magnetic_torque(spacecraft.rods.dipole(around.b_field_body), around.b_field_body)


MUNIN_TORQUES: tuple[AbstractTorque, ...] = (GravityGradient(), PermanentMagnet(), LinearRodsTorque())
"""The model of Penkov et al. 2009: gravity gradient, permanent magnet, two linear rods."""
