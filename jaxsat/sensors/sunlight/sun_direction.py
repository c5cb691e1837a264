"""Sun sensors that tell the Sun's direction itself, as a vector or as two angles."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import float_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.mounting import (
    BODY_AXES,
    NO_TURN,
    AbstractUnitVector,
    body_from_sensor,
    columns_of,
    directions_of,
    in_sensor,
    shorter_way,
)
from jaxsat.sensors.view import View


class SunVector(AbstractUnitVector):
    """Unit vector to the Sun in the sensor's axes; it reads so in the dark too, where the real one tells nothing."""

    needs: ClassVar[frozenset[str]] = frozenset({"light"})
    sees: ClassVar[Sight | None] = "sun"

    def target(self, view: View) -> Float[Array, "3"]:
        return view.sun


class SunAngles(AbstractSensor):
    """Two angles of the Sun about the sensor's z axis, atan2(x, z) and atan2(y, z) [rad].

    x, y, z are what the rows of `axes` read of the Sun's direction; z looks out.
    """

    needs: ClassVar[frozenset[str]] = frozenset({"light"})
    sees: ClassVar[Sight | None] = "sun"

    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "3 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Rows are the directions x, y and z of the angles."""

    def __call__(self, view: View) -> Float[Array, "2"]:
        x, y, z = columns_of(self.axes, in_sensor(self.turn, view.sun))
        return jnp.stack([_angle(x, z), _angle(y, z)])

    def difference(self, modelled: Float[Array, "2"], reading: Float[Array, "2"]) -> Float[Array, "2"]:
        """The shorter way round [rad]."""
        return shorter_way(modelled - reading)

    def direct(
        self, readings: Float[np.ndarray, "n 2"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]] | None:
        """Directions of the Sun in front of the sensor, NaN where an angle is a right one or more."""
        tangents = np.tan(np.where(np.abs(readings) < 0.5 * np.pi, readings, np.nan))
        read = np.concatenate([tangents, np.ones((len(tangents), 1))], axis=1)
        rows = np.asarray(self.axes, float)
        directions, _ = directions_of(read @ np.linalg.pinv(rows).T @ body_from_sensor(self.turn).T, 0.0)
        return directions, np.where(np.isfinite(directions).all(axis=1), sigma, np.nan)


def _angle(x, z):
    # Across both, where the angle has no meaning, there is no derivative either.
    across = (x == 0.0) & (z == 0.0)
    return jnp.arctan2(x, jnp.where(across, 1.0, z))
