"""What every torque has in common: what it reads and how it is called."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from jaxsat.spacecraft import Spacecraft

T = TypeVar("T")


class BodyEnvironment(eqx.Module):
    """What a torque reads at one instant besides the satellite's own numbers, in body axes."""

    position_body: Float[Array, "3"]
    """From the Earth's centre to the satellite [m]."""
    b_field_body: Float[Array, "3"]
    """Magnetic flux density [T]."""
    angular_velocity: Float[Array, "3"]
    """Of the body against inertial space [rad/s]."""
    b_field_rate_body: Float[Array, "3"] | None = None
    """Rate of the components of `b_field_body`, the turn of the body included [T/s]."""
    air_velocity_body: Float[Array, "3"] | None = None
    """Velocity of the satellite against the air [m/s]."""
    air_density: Float[Array, ""] | None = None
    """[kg/m^3]."""
    sun_body: Float[Array, "3"] | None = None
    """Unit vector to the Sun."""
    solar_pressure: Float[Array, ""] | None = None
    """Momentum flux of the sunlight, eclipse included [Pa]."""
    rod_lag: Float[Array, " rods"] | None = None
    """State of the hysteresis rods (`jaxsat.torques.hysteresis`)."""
    distance: Float[Array, ""] | None = None
    """Length of `position_body`, the same in all axes [m]; None where nobody has worked it out."""
    commands: Mapping[str, Float[Array | np.ndarray, ""]] | None = None
    """What coils and wheels were commanded, by the name of the column."""
    command_rates: Mapping[str, Float[Array | np.ndarray, ""]] | None = None
    """Rates of commands that change in a straight line [1/s]."""
    time: Float[Array, ""] | None = None
    """On the clock of the orbit's table, on which its orbit is given [s]; None where the table has none."""


class AbstractTorque(eqx.Module):
    """A torque that depends on the satellite and on what surrounds it."""

    smooth: eqx.AbstractClassVar[bool]
    """Whether it has no kinks along a motion: multistep methods want that."""

    @abstractmethod
    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        """Torque about the centre of mass, body axes [N m]."""


def required(entry: T | None, user: str, name: str, source: str) -> T:
    """`entry` itself; ValueError where it is absent, naming who needs it and where it comes from."""
    if entry is None:
        raise ValueError(f"{user} needs {name}, which is None: give {source}")
    return entry
