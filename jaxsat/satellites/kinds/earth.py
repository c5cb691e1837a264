"""Sensors of the Earth in a satellite file."""

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from jaxsat.satellites.kinds.common import TurnedKeys
from jaxsat.satellites.sections.fitted import PositiveScalar, plain

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor


class LimbKeys(TurnedKeys):
    """`kind = "limb"`: distance of the sensor's x from the Earth's limb, and turn of the limb about it."""

    quantity: ClassVar[str | None] = "rad"
    whole_axes: ClassVar[bool] = True
    earth_radius_km: PositiveScalar = plain(6371.2)
    """Up to the limb as the sensor sees it."""
    noise: Literal["angles", "sphere"] = "angles"
    """What the channel's sigma is of: of both angles as they are, or of angles on the sphere, so that a turn about a
    direction near the nadir is known the less."""

    @property
    def columns(self) -> int | None:
        return 2

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import LimbSensor

        turned = self.turned(name, leaves)
        leaves.add(
            f"{name}.earth_radius",
            f"sensors.{name}.earth_radius",
            self.earth_radius_km,
            unit="km",
            factor=1e3,
            loose=2e4,
            lower=0.0,
        )
        return LimbSensor(
            earth_radius=np.asarray(self.earth_radius_km.value * 1e3), on_sphere=self.noise == "sphere", **turned
        )


class HorizonVectorKeys(TurnedKeys):
    """`kind = "horizon_vector"`: unit vector to the Earth's centre."""

    quantity: ClassVar[str | None] = "1"

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        from jaxsat.sensors import HorizonVector

        return HorizonVector(**self.turned(name, leaves))
