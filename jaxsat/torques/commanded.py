"""Coils and wheels driven by what was commanded on board, as parts of a satellite.

Spacecraft(inertia, parts=(Coil([1, 0, 0], 2.0, "coil_x_A"), Wheel([0, 0, 1], 1e-5, "wheel_rad_s")))
"""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import cross, float_array
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment, required
from jaxsat.torques.magnetic import magnetic_torque

Number = Float[Array | np.ndarray, ""]

SOURCE = "Surroundings(..., commands=Commands.of(columns, held=..., linear=...))"


def _commanded(entries: Mapping[str, Number] | None, user: str, name: str, column: str) -> Number:
    """The entry of a column; ValueError where there is none."""
    found = required(entries, user, name, SOURCE)
    return required(found.get(column), user, f"{name}[{column!r}]", SOURCE)


class Coil(AbstractTorque):
    """A current loop whose current is a column of the telemetry."""

    smooth: ClassVar[bool] = False

    axis: Float[Array, "3"] = eqx.field(converter=float_array)
    """Unit vector of the moment of a positive current, body axes."""
    area_turns: Float[Array, ""] = eqx.field(converter=float_array)
    """Moment over current: area times turns [m^2]."""
    column: str = eqx.field(static=True)
    """Of the current [A], which is held until the next row."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        current = _commanded(around.commands, "Coil", "BodyEnvironment.commands", self.column)
        return magnetic_torque(self.area_turns * current * self.axis, around.b_field_body)


def wheel_torque(
    axis: Float[Array, "3"],
    inertia: Float[Array, ""],
    speed: Number,
    acceleration: Number,
    angular_velocity: Float[Array, "3"],
) -> Float[Array, "3"]:
    """-I (s' a + w x s a) [N m]: what a wheel of speed s against the body takes from the body's own momentum J w.

    The momentum of both is J w + I s a, the inertia J being that of the satellite with its wheels locked (Markley &
    Crassidis 2014, sec. 3.3.5).
    """
    return -inertia * (acceleration * axis + speed * cross(angular_velocity, axis))


class Wheel(AbstractTorque):
    """A reaction or momentum wheel whose speed is a column of the telemetry."""

    smooth: ClassVar[bool] = False

    axis: Float[Array, "3"] = eqx.field(converter=float_array)
    """Unit vector of the spin at a positive speed, body axes."""
    inertia: Float[Array, ""] = eqx.field(converter=float_array)
    """About its axis [kg m^2]; the satellite's inertia contains it."""
    column: str = eqx.field(static=True)
    """Of the speed against the body [rad/s], linear between rows."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        speed = _commanded(around.commands, "Wheel", "BodyEnvironment.commands", self.column)
        acceleration = _commanded(around.command_rates, "Wheel", "BodyEnvironment.command_rates", self.column)
        return wheel_torque(self.axis, self.inertia, speed, acceleration, around.angular_velocity)


def commanded_columns(parts: Sequence[eqx.Module]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Columns that the parts of a satellite follow: those that are held between rows, and those that are linear."""
    coils = [part.column for part in parts if isinstance(part, Coil)]
    wheels = [part.column for part in parts if isinstance(part, Wheel)]
    return tuple(dict.fromkeys(coils)), tuple(dict.fromkeys(wheels))
