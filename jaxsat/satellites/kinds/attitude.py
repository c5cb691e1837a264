"""Star tracker, or any on-board quaternion, in a satellite file."""

from typing import TYPE_CHECKING, ClassVar, Literal

from jaxsat.satellites.kinds.common import SensorKeys
from jaxsat.satellites.sections.fitted import Triple, plain

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor


class StarTrackerKeys(SensorKeys):
    """`kind = "star_tracker"`: a quaternion, scalar first."""

    quantity: ClassVar[str | None] = "1"
    turn: Triple = plain((0.0, 0.0, 0.0))
    """Rotation vector from the body's axes to the tracker's [rad]."""
    sense: Literal["inertial_from_body", "body_from_inertial"] = "inertial_from_body"
    """Which way the quaternion turns; inertial is true equator and equinox of date."""

    @property
    def columns(self) -> int | None:
        return 4

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.satellites.leaves import XYZ, as_array
        from jaxsat.sensors import StarTracker

        leaves.add(f"{name}.turn", f"sensors.{name}.turn", self.turn, XYZ, unit="rad", loose=0.2)
        return StarTracker(turn=as_array(self.turn, 3), body_from_inertial=self.sense == "body_from_inertial")
