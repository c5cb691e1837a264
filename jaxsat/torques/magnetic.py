"""Torques of the Earth's field on a permanent dipole and on rods that are magnetised in proportion to the field."""

from typing import ClassVar

from jaxtyping import Array, Float

from jaxsat.math import cross
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment, required


def magnetic_torque(dipole: Float[Array, "3"], b_field_body: Float[Array, "3"]) -> Float[Array, "3"]:
    """m x B [N m]: it turns the dipole toward the field (Jackson 1999, eq. 5.71)."""
    return cross(dipole, b_field_body)


class PermanentMagnet(AbstractTorque):
    """Torque on the satellite's permanent dipole."""

    smooth: ClassVar[bool] = True

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        magnet = required(spacecraft.magnet, "PermanentMagnet", "Spacecraft.magnet", "the dipole in body axes")
        return magnetic_torque(magnet, around.b_field_body)


class LinearRodsTorque(AbstractTorque):
    """Torque on the moment that the field induces in the rods."""

    smooth: ClassVar[bool] = True

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        rods = required(spacecraft.rods, "LinearRodsTorque", "Spacecraft.rods", "the rods, as MagneticRods")
        return magnetic_torque(rods.dipole(around.b_field_body), around.b_field_body)
