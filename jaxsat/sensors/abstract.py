"""What all sensors have in common: a reading of a view, and what a reading says of the attitude by itself."""

from abc import abstractmethod
from typing import ClassVar, Literal

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.sensors.noise import Size, normal_noise
from jaxsat.sensors.view import View

Sight = Literal["field", "sun", "nadir", "rate", "attitude"]
"""What a sensor may see by itself: a known direction, the angular velocity, or the attitude."""


class AbstractSensor(eqx.Module):
    """A sensor and its calibration, every number of which is a leaf.

    A sensor of one's own is this class with `__call__`; what else is here may stay as it is.
    """

    needs: ClassVar[frozenset[str]] = frozenset()
    """What it reads beyond attitude, rate, position and field: `light`."""
    sees: ClassVar[Sight | None] = None
    """What `direct` returns."""

    @abstractmethod
    def __call__(self, view: View) -> Float[Array, " channels"]:
        """The mean reading without noise, SI."""

    def difference(
        self, modelled: Float[Array, " channels"], reading: Float[Array, " channels"]
    ) -> Float[Array, " differences"]:
        """What a fit makes small; a quaternion or an angle differs on its sphere."""
        return modelled - reading

    def sharpness(self, view: View) -> float | Float[Array, " differences"]:
        """What the stated noise is over that of each difference: below 1 where the sensor tells it worse."""
        return 1.0

    def noisy(self, reading: Float[Array, " channels"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " channels"]:
        """A mean reading with noise of `sigma` on each channel, as the sensor itself sends it."""
        return normal_noise(reading, sigma, key)

    def direct(
        self, readings: Float[np.ndarray, "n channels"], sigma: float
    ) -> tuple[Float[np.ndarray, "n ..."], Float[np.ndarray, " n"]] | None:
        """What readings say by the calibration as it stands, and the 1-sigma of it for a `sigma` of a reading.

        Unit vectors in body axes [n 3] and angles [rad] for `field`, `sun` and `nadir`; body rates [n 3] and [rad/s]
        for `rate`; quaternions [n 4] and angles for `attitude`. Where a reading says nothing its row is NaN.
        """
        return None
