"""A constant torque in body axes: a leak, a misaligned thruster, whatever the other torques leave over."""

from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from jaxsat.math import float_array
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment


class ResidualTorque(AbstractTorque):
    """A torque that does not depend on attitude, position or time."""

    smooth: ClassVar[bool] = True

    torque: Float[Array, "3"] = eqx.field(converter=float_array)
    """Body axes [N m]."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        return self.torque
