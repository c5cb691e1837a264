"""Gyroscope: the body's angular velocity along the sensor's axes."""

from typing import ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import float_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.mounting import BODY_AXES, NO_TURN, body_from_sensor, columns_of, in_sensor, vectors_of
from jaxsat.sensors.view import View


class Gyroscope(AbstractSensor):
    """Angular velocity [rad/s]: scale w + bias, w in the sensor's axes."""

    sees: ClassVar[Sight | None] = "rate"

    bias: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """[rad/s]"""
    scale: Float[Array, "3"] = eqx.field(converter=float_array, default=(1.0, 1.0, 1.0))
    """Reading over rate about each axis."""
    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "channels 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Row k is the direction that column k reads."""

    def __call__(self, view: View) -> Float[Array, " channels"]:
        return columns_of(self.axes, self.scale * in_sensor(self.turn, view.rate) + self.bias)

    def direct(
        self, readings: Float[np.ndarray, "n channels"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]] | None:
        """Body rates [rad/s] and the 1-sigma of a component."""
        read = vectors_of(readings, self.axes)
        if read is None:
            return None
        scale = np.asarray(self.scale, float)
        rates = (read - np.asarray(self.bias, float)) / scale @ body_from_sensor(self.turn).T
        known = np.isfinite(rates).all(axis=1)
        return rates, np.where(known, sigma / np.min(np.abs(scale)), np.nan)
