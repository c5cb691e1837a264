"""The direction of the Earth's centre, as a horizon sensor or its computer tells it."""

from typing import ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.mounting import (
    BODY_AXES,
    NO_TURN,
    body_from_sensor,
    columns_of,
    directions_of,
    in_sensor,
    unit_readings,
    vectors_of,
)
from jaxsat.sensors.noise import Size, unit_noise
from jaxsat.sensors.view import View


class HorizonVector(AbstractSensor):
    """Unit vector to the Earth's centre in the sensor's axes."""

    sees: ClassVar[Sight | None] = "nadir"

    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "channels 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Row k is the direction that column k reads."""

    def __call__(self, view: View) -> Float[Array, " channels"]:
        return columns_of(self.axes, in_sensor(self.turn, view.nadir))

    def noisy(self, reading: Float[Array, " channels"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " channels"]:
        """A unit vector again."""
        return unit_noise(reading, sigma, key)

    def direct(
        self, readings: Float[np.ndarray, "n channels"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]] | None:
        """Directions of the nadir, NaN where the reading is no unit vector (`unit_readings`)."""
        read = vectors_of(readings, self.axes)
        if read is None:
            return None
        return directions_of(unit_readings(read, sigma) @ body_from_sensor(self.turn).T, sigma)
