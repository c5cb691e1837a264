"""Star tracker, or any other attitude that is told as a quaternion."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array, quaternion, unit
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.mounting import NO_TURN
from jaxsat.sensors.noise import Size, normal_noise
from jaxsat.sensors.view import View


class StarTracker(AbstractSensor):
    """Quaternion of the sensor's attitude, scalar first; its sign means nothing.

    Its noise is a turn: sigma is that of the angle about each axis [rad], as data sheets have it.
    """

    sees: ClassVar[Sight | None] = "attitude"

    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    body_from_inertial: bool = eqx.field(static=True, default=False)
    """Whether it is sent the other way round: sensor from inertial."""

    def __call__(self, view: View) -> Float[Array, "4"]:
        q = quaternion.multiply(view.attitude, quaternion.from_rotation_vector(self.turn))
        return quaternion.conjugate(q) if self.body_from_inertial else q

    def difference(self, modelled: Float[Array, "4"], reading: Float[Array, "4"]) -> Float[Array, "3"]:
        """Turn from the reading to the model about each axis, the shorter way [rad]; of large ones twice the sine of
        half the angle.
        """
        apart = quaternion.multiply(quaternion.conjugate(unit(reading)), modelled)
        return 2.0 * jnp.where(apart[0] < 0.0, -apart[1:], apart[1:])

    def noisy(self, reading: Float[Array, "4"], sigma: Size, key: PRNGKeyArray) -> Float[Array, "4"]:
        """The attitude turned about each axis by as much [rad]."""
        return quaternion.multiply(reading, quaternion.from_rotation_vector(normal_noise(jnp.zeros(3), sigma, key)))

    def direct(
        self, readings: Float[np.ndarray, "n 4"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 4"], Float[np.ndarray, " n"]] | None:
        """Attitudes, inertial from body, and the 1-sigma angle about an axis [rad]."""
        length = np.linalg.norm(readings, axis=1)
        q = readings / np.where(length > 0.0, length, np.nan)[:, None]
        if self.body_from_inertial:
            q = q * np.array([1.0, -1.0, -1.0, -1.0])
        turn = np.asarray(self.turn, float)
        half = 0.5 * np.linalg.norm(turn)
        back = np.array([np.cos(half), *(-0.5 * np.sinc(half / np.pi) * turn)])
        known = np.isfinite(q).all(axis=1)
        return _times(q, back), np.where(known, sigma, np.nan)


def _times(p: Float[np.ndarray, "n 4"], q: Float[np.ndarray, "4"]) -> Float[np.ndarray, "n 4"]:
    """Hamilton products p q on the host."""
    w, x, y, z = q
    right = np.array([[w, x, y, z], [-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
    return p @ right
