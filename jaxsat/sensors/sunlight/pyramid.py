"""The Sun sensor with photocells on a truncated pyramid, mounted on a satellite."""

from typing import ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import float_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.mounting import BODY_AXES, NO_TURN, body_from_sensor, columns_of, in_sensor
from jaxsat.sensors.sun_sensor import PyramidSunSensor, face_currents
from jaxsat.sensors.sunlight.sun_of_cells import Cells, sun_of_cells
from jaxsat.sensors.view import View


class PyramidSensor(AbstractSensor):
    """Currents of the four faces of a `PyramidSunSensor` [A]; the light of the Earth is left out."""

    needs: ClassVar[frozenset[str]] = frozenset({"light"})
    sees: ClassVar[Sight | None] = "sun"

    instrument: PyramidSunSensor = eqx.field(default_factory=PyramidSunSensor)
    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "3 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Rows are the instrument's axes; the first one looks out."""

    def __call__(self, view: View) -> Float[Array, "4"]:
        sun = columns_of(self.axes, in_sensor(self.turn, view.sun))
        return view.lit.illumination * face_currents(self.instrument, sun)

    def direct(
        self, readings: Float[np.ndarray, "n 4"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Directions of the Sun, NaN where it is not seen (`sun_of_cells`)."""
        full = float(self.instrument.max_current)
        normals = np.asarray(self.instrument.normals(), float)
        cells = _cells(self.instrument, normals)
        sun, angles = sun_of_cells(readings / full, np.full(4, sigma / full), cells, normals, earthlight=False)
        return sun @ np.asarray(self.axes, float) @ body_from_sensor(self.turn).T, angles


def _cells(instrument: PyramidSunSensor, normals: np.ndarray) -> Cells:
    """`face_currents` over the largest one, on the host."""
    distance = float(instrument.hood_distance())
    face, cutoff, hood = (float(x) for x in (instrument.face_angle, instrument.cutoff_angle, instrument.hood_angle))

    def cells(sun):
        x = np.clip(sun[..., 0], 0.0, 1.0)
        share = distance * x / (np.sin(face) * x + np.cos(face) * np.sqrt(1.0 - x * x))
        cosine = sun @ normals.T
        seen = (cosine > np.cos(cutoff)) & (sun[..., :1] > 0.0)
        return np.where(x < np.cos(hood), share, 1.0)[..., None] * np.where(seen, cosine, 0.0)

    return cells
