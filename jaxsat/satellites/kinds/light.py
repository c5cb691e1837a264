"""Photodiodes and solar panels in a satellite file."""

import math
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from jaxsat.files.units import parsed_unit
from jaxsat.satellites.kinds.common import CurrentUnit, Normals, SensorKeys, largest_reading
from jaxsat.satellites.sections.fitted import Fitted, PositiveScalar, Scalar, UnitText, panel_names, plain
from jaxsat.setting_types import NonNegative, Section

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor


class _Faces(SensorKeys):
    """Sensors of light, one column a normal."""

    normals: Normals
    """Where each looks, one a column, as ["+x", "-x", [0, 0.6, 0.8]]."""
    gain: Fitted = plain(1.0)
    """One for all or one each: reading with the Sun on the axis; of panels over `imax`."""
    earthlight: bool = True
    """Whether light of the Earth counts."""

    @model_validator(mode="after")
    def _gains(self):
        count = len(self.normals)
        if np.shape(self.gain.value) not in ((), (count,)):
            raise ValueError(f"gain: expected a number or one for each of the {count} normals")
        if not np.all(np.asarray(self.gain.value) > 0.0):
            raise ValueError("gain: expected values above zero")
        return self

    @property
    def columns(self) -> int | None:
        return len(self.normals)

    def add_gains(self, name: str, leaves: "LeafList", *, unit: str = "1", factor: float = 1.0) -> np.ndarray:
        """The gains, SI; adds their leaves, named after the faces."""
        suffixes = [f".{face}" for face in panel_names(self.normals)]
        gain = self.gain.filled(len(suffixes)) * factor
        loose = 0.3 * float(np.mean(gain))
        place = f"sensors.{name}.gain"
        leaves.add(f"{name}.gain", place, self.gain, suffixes, unit=unit, factor=factor, loose=loose, lower=0.0)
        return gain


class _TiltedFaces(_Faces):
    """Faces that may be turned off their places."""

    tilts_deg: Fitted | None = None
    """Turns of each off its place about the two body axes across it: pairs, one a normal."""

    @model_validator(mode="after")
    def _tilts(self):
        if self.tilts_deg is not None and np.shape(self.tilts_deg.value) not in ((), (len(self.normals), 2)):
            raise ValueError(f"tilts_deg: expected a pair for each of the {len(self.normals)} normals")
        return self

    def add_tilts(self, name: str, leaves: "LeafList") -> np.ndarray | None:
        """The tilts, SI, None where there are none; adds their leaves, named after the faces and axes."""
        given = self.tilts_deg
        if given is None:
            return None
        shape, degree = (len(self.normals), 2), math.radians(1.0)
        # Named by the axes that the sensor turns a panel about: of a face of a box the two others.
        across = [[axis for axis, size in zip("xyz", normal, strict=True) if not size] for normal in self.normals]
        pairs = [axes if len(axes) == 2 else ["0", "1"] for axes in across]
        faces = panel_names(self.normals)
        suffixes = [f".{face}.{axis}" for face, axes in zip(faces, pairs, strict=True) for axis in axes]
        sigmas = given.sigmas(*shape)
        flat = given.model_copy(update={"sigma": None if sigmas is None else tuple(sigmas.reshape(-1).tolist())})
        place = f"sensors.{name}.tilts"
        leaves.add(f"{name}.tilts", place, flat, suffixes, unit="deg", factor=degree, loose=0.05)
        return given.filled(*shape) * degree


class TablePoint(Section):
    """Response at an angle off the normal."""

    angle_deg: NonNegative
    response: NonNegative


class PhotodiodeKeys(_Faces):
    """`kind = "photodiodes"`: each reads gain x response(angle of the Sun off its normal)."""

    unit: UnitText = "1"
    """Of the gain and of the columns."""
    response: Literal["cosine", "power", "table"] = "cosine"
    """Law of the angle between Sun and normal."""
    limit_deg: PositiveScalar | None = None
    """Of the power law 1 - (angle/limit)^exponent: angle beyond which a diode sees nothing."""
    exponent: PositiveScalar | None = None
    """Of the power law."""
    table: Annotated[tuple[TablePoint, ...], Field(strict=False, min_length=2)] | None = None
    """Of the response "table": points {angle_deg, response}, joined by straight lines."""

    @model_validator(mode="after")
    def _law(self):
        if self.response != "power" and (self.limit_deg or self.exponent) is not None:
            raise ValueError('limit_deg and exponent belong to response = "power"')
        if (self.response == "table") != (self.table is not None):
            raise ValueError('table = [{angle_deg, response}, ...] belongs to response = "table"')
        if self.table is not None and not np.all(np.diff([point.angle_deg for point in self.table]) > 0.0):
            raise ValueError("table: expected growing angles")
        return self

    def reading_unit(self) -> str | None:
        return parsed_unit(self.unit).quantity

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import Photodiodes

        here = f"sensors.{name}"
        gain = self.add_gains(name, leaves, unit=self.unit, factor=parsed_unit(self.unit).factor)
        limit, exponent = self.limit_deg or plain(90.0), self.exponent or plain(2.0)
        degree = math.radians(1.0)
        if self.response == "power":
            leaves.add(
                f"{name}.limit", f"{here}.limit", limit, unit="deg", factor=degree, loose=0.2, lower=0.0, upper=math.pi
            )
            leaves.add(f"{name}.exponent", f"{here}.exponent", exponent, loose=1.0, lower=0.0)
        table = self.table
        return Photodiodes(
            normals=np.array(self.normals),
            gain=gain,
            limit=np.asarray(limit.value * degree),
            exponent=np.asarray(exponent.value),
            table_angle=None if table is None else np.radians([point.angle_deg for point in table]),
            table_value=None if table is None else np.array([point.response for point in table]),
            response=self.response,
            earthlight=self.earthlight,
        )


class PanelKeys(_TiltedFaces):
    """`kind = "panels"`: each gives gain x imax in sunlight square on."""

    imax: PositiveScalar
    """Current of a panel of gain 1 that faces the Sun [unit]."""
    unit: CurrentUnit = "mA"
    """Of imax."""

    def reading_unit(self) -> str | None:
        return "A"

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import Panels

        most = largest_reading(name, f"sensors.{name}.max_current", self.imax, self.unit, leaves)
        gain = self.add_gains(name, leaves)
        return Panels(
            normals=np.array(self.normals),
            max_current=np.asarray(most),
            gain=gain,
            tilts=self.add_tilts(name, leaves),
            earthlight=self.earthlight,
        )


class SunElevationKeys(_TiltedFaces):
    """`kind = "sun_elevation"`: photodiodes that send the elevation of the Sun over their planes."""

    quantity: ClassVar[str | None] = "rad"
    rim: Scalar | None = None
    """What shades each diode at low elevations, or shines into it: one value and sigma for all its harmonics."""

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import SunElevation

        return SunElevation(
            normals=np.array(self.normals),
            gain=self.add_gains(name, leaves),
            tilts=self.add_tilts(name, leaves),
            rim=self._add_rim(name, leaves),
            earthlight=self.earthlight,
        )

    def _add_rim(self, name: str, leaves: "LeafList") -> np.ndarray | None:
        from jaxsat.sensors.sunlight.sun_elevation import HARMONICS

        if self.rim is None:
            return None
        waves = [f"{wave}{m}" for m in range(1, HARMONICS + 1) for wave in ("cos", "sin")]
        suffixes = [f".{face}.{wave}" for face in panel_names(self.normals) for wave in waves]
        count = len(suffixes)
        flat = self.rim.model_copy(update={"value": (self.rim.value,) * count})
        leaves.add(f"{name}.rim", f"sensors.{name}.rim", flat, suffixes, loose=0.3)
        return np.full((len(self.normals), len(waves)), float(self.rim.value))
