"""Magnetometer and gyroscope in a satellite file."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from jaxsat.files.units import parsed_unit
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.satellites.kinds.common import FieldUnit, RateUnit, TurnedKeys
from jaxsat.satellites.sections.fitted import Fitted, PositiveTriple, Triple, UnitText, plain

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor

_LOOSE_BIAS_T, _LOOSE_STRAY_T, _LOOSE_BIAS_RAD_S = 2e-5, 5e-6, 0.02


class Stray(Fitted):
    """Field of currents on board: it follows the light on the six faces, or columns."""

    value: Any = 0.0
    by: Any = "faces"
    """"faces", or names of columns."""
    column_unit: UnitText = "1"
    """Of those columns; the field is that of one of it."""

    @model_validator(mode="after")
    def _by(self):
        names = self.by if isinstance(self.by, list | tuple) else ()
        if self.by != "faces" and not (names and all(isinstance(name, str) for name in names)):
            raise ValueError('by: expected "faces" or a list of columns')
        return self

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that it follows; none where it follows the faces."""
        return () if self.by == "faces" else tuple(self.by)


class MagnetometerKeys(TurnedKeys):
    """`kind = "magnetometer"`."""

    quantity: ClassVar[str | None] = "T"
    unit: FieldUnit = "uT"
    """Of bias and stray field."""
    unit_vector: bool = False
    """Whether only the direction is sent."""
    bias: Triple = plain((0.0, 0.0, 0.0))
    """Along the sensor's axes [unit]."""
    scale: PositiveTriple = plain((1.0, 1.0, 1.0))
    """Reading over field along each axis."""
    shear: Triple = plain((0.0, 0.0, 0.0))
    """Off-diagonal entries yz, xz, xy of a symmetric matrix."""
    stray: Annotated[Stray, Field()] | None = None
    """Bias by currents on board: {by = "faces", sigma = 3.0} follows the light on the six faces, {by = ["i1", "i2"],
    column_unit = "mA"} columns."""

    def reading_unit(self) -> str | None:
        return "1" if self.unit_vector else "T"

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.satellites.leaves import XYZ, as_array
        from jaxsat.sensors import Magnetometer

        here, unit = f"sensors.{name}", parsed_unit(self.unit)
        leaves.add(
            f"{name}.bias", f"{here}.bias", self.bias, XYZ, unit=self.unit, factor=unit.factor, loose=_LOOSE_BIAS_T
        )
        turned = self.turned(name, leaves)
        leaves.add(f"{name}.scale", f"{here}.scale", self.scale, XYZ, loose=0.2, lower=0.0)
        leaves.add(f"{name}.shear", f"{here}.shear", self.shear, XYZ, loose=0.1)
        stray = None
        if self.stray is not None:
            names = self.stray.columns or PANEL_NAMES
            factor, shown = unit.factor, self.unit
            if self.stray.columns and self.stray.column_unit != "1":
                factor, shown = (
                    unit.factor / parsed_unit(self.stray.column_unit).factor,
                    f"{self.unit}/{self.stray.column_unit}",
                )
            stray = np.asarray(self.stray.filled(len(names), 3)) * factor
            suffixes = [f".{each}{axis}" for each in names for axis in XYZ]
            flat = self.stray.model_copy(
                update={"sigma": None if self.stray.sigma is None else _flat(self.stray, len(names))}
            )
            leaves.add(
                f"{name}.stray", f"{here}.stray", flat, suffixes, unit=shown, factor=factor, loose=_LOOSE_STRAY_T
            )
        return Magnetometer(
            bias=as_array(self.bias, 3, factor=unit.factor),
            scale=as_array(self.scale, 3),
            shear=as_array(self.shear, 3),
            stray=stray,
            stray_columns=() if self.stray is None else self.stray.columns,
            unit_vector=self.unit_vector,
            **turned,
        )


def _flat(stray: Stray, count: int) -> tuple[float, ...]:
    return tuple(np.broadcast_to(np.asarray(stray.sigma), (count, 3)).reshape(-1).tolist())


class GyroKeys(TurnedKeys):
    """`kind = "gyro"`."""

    quantity: ClassVar[str | None] = "rad/s"
    unit: RateUnit = "deg/s"
    """Of the bias."""
    bias: Triple = plain((0.0, 0.0, 0.0))
    """About the sensor's axes [unit]."""
    scale: PositiveTriple = plain((1.0, 1.0, 1.0))
    """Reading over rate about each axis."""

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.satellites.leaves import XYZ, as_array
        from jaxsat.sensors import Gyroscope

        here, unit = f"sensors.{name}", parsed_unit(self.unit)
        leaves.add(
            f"{name}.bias", f"{here}.bias", self.bias, XYZ, unit=self.unit, factor=unit.factor, loose=_LOOSE_BIAS_RAD_S
        )
        turned = self.turned(name, leaves)
        leaves.add(f"{name}.scale", f"{here}.scale", self.scale, XYZ, loose=0.2, lower=0.0)
        return Gyroscope(bias=as_array(self.bias, 3, factor=unit.factor), scale=as_array(self.scale, 3), **turned)
