"""Sensors of the Sun's direction in a satellite file."""

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from jaxsat.files.units import parsed_unit
from jaxsat.satellites.kinds.common import TurnedKeys, largest_reading
from jaxsat.satellites.sections.fitted import PositiveScalar, UnitText, plain

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor


class SunVectorKeys(TurnedKeys):
    """`kind = "sun_vector"`: a unit vector."""

    quantity: ClassVar[str | None] = "1"

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import SunVector

        return SunVector(**self.turned(name, leaves))


class SunAngleKeys(TurnedKeys):
    """`kind = "sun_angles"`: angles of the Sun about the sensor's z, atan2(x, z) and atan2(y, z)."""

    quantity: ClassVar[str | None] = "rad"
    whole_axes: ClassVar[bool] = True

    @property
    def columns(self) -> int | None:
        return 2

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import SunAngles

        return SunAngles(**self.turned(name, leaves))


class PyramidKeys(TurnedKeys):
    """`kind = "pyramid"`: four faces about the sensor's x (Zhukov 2019)."""

    whole_axes: ClassVar[bool] = True

    unit: UnitText = "1"
    """Of imax and of the columns."""
    imax: PositiveScalar = plain(1.0)
    """Current of a face that looks at the Sun."""
    face_angle_deg: PositiveScalar = plain(22.0)
    """Between each face's normal and the sensor's x."""
    cutoff_angle_deg: PositiveScalar = plain(83.0)
    """From a face's normal at which it sees nothing more."""
    hood_angle_deg: PositiveScalar = plain(74.0)
    """From the sensor's x at which its hood takes the light."""

    @property
    def columns(self) -> int | None:
        return 4

    def reading_unit(self) -> str | None:
        return parsed_unit(self.unit).quantity

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import PyramidSensor, PyramidSunSensor

        degree = math.radians(1.0)
        turned, here = self.turned(name, leaves), f"sensors.{name}.instrument"
        most = largest_reading(name, f"{here}.max_current", self.imax, self.unit, leaves)
        angles = {}
        for key in ("face_angle", "cutoff_angle", "hood_angle"):
            given = getattr(self, f"{key}_deg")
            leaves.add(
                f"{name}.{key}",
                f"{here}.{key}",
                given,
                unit="deg",
                factor=degree,
                loose=0.1,
                lower=0.0,
                upper=0.5 * math.pi,
            )
            angles[key] = np.asarray(given.value * degree)
        return PyramidSensor(instrument=PyramidSunSensor(max_current=np.asarray(most), **angles), **turned)
