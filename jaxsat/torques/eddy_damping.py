"""Damping by eddy currents in the satellite's conducting shell, as a part of one's own.

Spacecraft(inertia, parts=(EddyDamping(k),))
"""

from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from jaxsat.math import cross, float_array
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment


def eddy_damping_torque(
    coefficient: Float[Array, ""], angular_velocity: Float[Array, "3"], b_field_body: Float[Array, "3"]
) -> Float[Array, "3"]:
    """k (w x B) x B = -k (B^2 w - (B . w) B) [N m]: it opposes rotation across the field (Smith 1962).

    The moment k (w x B) is that of a shell alike in all directions, turning in a field that itself hardly turns.
    """
    dipole = coefficient * cross(angular_velocity, b_field_body)
    return cross(dipole, b_field_body)


class EddyDamping(AbstractTorque):
    """Eddy currents in a shell alike in all directions."""

    smooth: ClassVar[bool] = True

    coefficient: Float[Array, ""] = eqx.field(converter=float_array)
    """Moment for a field and a rate across it, k [A m^2 s / T]: 2 pi / 3 conductivity r^4 d of a sphere of radius r
    and thickness d."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        return eddy_damping_torque(self.coefficient, around.angular_velocity, around.b_field_body)
