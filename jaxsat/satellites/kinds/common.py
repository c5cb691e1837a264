"""What the keys of all sensors have in common."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from jaxsat.files.units import parsed_unit
from jaxsat.satellites.sections.fitted import Direction, Fitted, Triple, plain, to_direction
from jaxsat.setting_types import Section

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor


class SensorKeys(Section):
    """A section `[sensors.NAME]`."""

    kind: str
    quantity: ClassVar[str | None] = None
    """SI unit of what its columns hold; None: that of the section's own `unit`."""

    @property
    def columns(self) -> int | None:
        """How many columns it has, None where the file decides."""
        return 3

    def reading_unit(self) -> str | None:
        """SI unit that its channel must have, None for any."""
        return self.quantity

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        """The sensor; its numbers are added to the leaves."""
        raise NotImplementedError


_EXPECTED_AXES = 'expected directions such as ["+x", "-z", "+y"], one a column, "unknown" or "mirrored"'


def _axes(found: Any) -> Any:
    if found in ("unknown", "mirrored"):
        return found
    if not isinstance(found, list | tuple) or not 1 <= len(found) <= 3:
        raise ValueError(_EXPECTED_AXES)
    rows = np.array([to_direction(row) for row in found])
    if not np.allclose(rows @ rows.T, np.eye(len(rows)), rtol=0.0, atol=1e-3):
        raise ValueError("expected directions at right angles to each other")
    return tuple(map(tuple, rows.tolist()))


Axes = Annotated[Any, BeforeValidator(_axes)]
"""Body direction that each column reads."""
NO_AXES = tuple(map(tuple, np.eye(3).tolist()))

Normals = Annotated[tuple[Direction, ...], Field(strict=False, min_length=1)]


def axes_matrix(axes: Any) -> np.ndarray:
    """[3 3]; the identity where they are not known."""
    return np.eye(3) if isinstance(axes, str) else np.asarray(axes, float)


class TurnedKeys(SensorKeys):
    """A sensor with axes of its own, nearly those of the body or of `axes`."""

    whole_axes: ClassVar[bool] = False
    """Whether all three axes are needed whatever the columns."""
    axes: Axes = NO_AXES
    """Body direction that each column reads, as ["+x", "-z", "+y"], or the rows of a matrix; "unknown" where nobody
    knows (the 24 right-handed ones are tried), "mirrored" (all 48)."""
    turn: Triple = plain((0.0, 0.0, 0.0))
    """Rotation vector from the body's axes to the sensor's [rad]."""

    @model_validator(mode="after")
    def _three(self):
        if self.whole_axes and len(axes_matrix(self.axes)) != 3:
            raise ValueError(f"axes: expected three directions, found {len(self.axes)}")
        return self

    @property
    def columns(self) -> int | None:
        return len(axes_matrix(self.axes))

    def turned(self, name: str, leaves: "LeafList") -> dict[str, Any]:
        """Turn and axes of the sensor by name; adds the leaves of the turn."""
        from jaxsat.satellites.leaves import XYZ, as_array

        leaves.add(f"{name}.turn", f"sensors.{name}.turn", self.turn, XYZ, unit="rad", loose=0.2)
        return {"turn": as_array(self.turn, 3), "axes": axes_matrix(self.axes)}


def largest_reading(name: str, place: str, given: Fitted, unit: str, leaves: "LeafList") -> float:
    """`imax` of a sensor, SI; adds its leaf."""
    factor = parsed_unit(unit).factor
    most = given.value * factor
    leaves.add(f"{name}.imax", place, given, unit=unit, factor=factor, loose=0.3 * most, lower=0.0)
    return most


def _of_quantity(*quantities: str):
    def check(text: str) -> str:
        if parsed_unit(text).quantity not in quantities:
            raise ValueError(f"expected a unit of {' or '.join(quantities)}")
        return text

    return AfterValidator(check)


FieldUnit = Annotated[str, _of_quantity("T")]
RateUnit = Annotated[str, _of_quantity("rad/s")]
CurrentUnit = Annotated[str, _of_quantity("A")]
