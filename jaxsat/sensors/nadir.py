"""The direction of the Earth's centre, as a horizon sensor or its computer tells it."""

from typing import ClassVar

from jaxtyping import Array, Float

from jaxsat.sensors.abstract import Sight
from jaxsat.sensors.mounting import AbstractUnitVector
from jaxsat.sensors.view import View


class HorizonVector(AbstractUnitVector):
    """Unit vector to the Earth's centre in the sensor's axes."""

    sees: ClassVar[Sight | None] = "nadir"

    def target(self, view: View) -> Float[Array, "3"]:
        return view.nadir
