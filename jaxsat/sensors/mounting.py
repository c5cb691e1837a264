"""How a sensor sits in its satellite: by a small turn of its axes, and by the directions that its columns read."""

import itertools
from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array, quaternion
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.noise import Size, unit_noise
from jaxsat.sensors.view import View

NO_TURN = (0.0, 0.0, 0.0)
BODY_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def in_sensor(turn: Float[Array, "3"], vector_body: Float[Array, "3"]) -> Float[Array, "3"]:
    """Components of a body vector in the sensor's axes: the body's axes turned by the rotation vector `turn` [rad]."""
    return quaternion.rotate_inverse(quaternion.from_rotation_vector(turn), vector_body)


def columns_of(axes: Float[Array, "channels 3"], vector: Float[Array, "3"]) -> Float[Array, " channels"]:
    """What columns read of a vector, row k of `axes` being the direction that column k reads."""
    return jnp.sum(axes * vector[None, :], axis=-1)


def shorter_way(angle: Float[Array, " n"]) -> Float[Array, " n"]:
    """Angles in [-pi, pi) [rad]."""
    return jnp.remainder(angle + jnp.pi, 2.0 * jnp.pi) - jnp.pi


def body_from_sensor(turn: Float[Array, "3"]) -> Float[np.ndarray, "3 3"]:
    """Direction cosine matrix of the turn, on the host (Rodrigues' formula)."""
    vector = np.asarray(turn, float)
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across


def directions_of(
    vectors: Float[np.ndarray, "n 3"], sigma: Float[np.ndarray, " n"] | float
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Unit vectors, and the angles [rad] that an error `sigma` of each component turns them by; NaN for none."""
    lengths = np.linalg.norm(vectors, axis=-1)
    lengths = np.where(lengths > 0.0, lengths, np.nan)
    # An error as large as the vector itself says nothing of its direction, and no angle is larger than half a turn.
    return vectors / lengths[:, None], np.minimum(sigma / lengths, np.pi)


def unit_readings(readings: Float[np.ndarray, "n 3"], sigma: float) -> Float[np.ndarray, "n 3"]:
    """Readings of a unit vector, NaN where they are none to a tenth, or to five of their errors."""
    off = np.abs(np.linalg.norm(readings, axis=1) - 1.0)
    return np.where((off < max(0.1, 5.0 * sigma))[:, None], readings, np.nan)


def vectors_of(
    readings: Float[np.ndarray, "n channels"], axes: Float[Array, "channels 3"]
) -> Float[np.ndarray, "n 3"] | None:
    """Vectors in the sensor's axes from their columns, None where the columns do not span them."""
    rows = np.asarray(axes, float)
    if np.linalg.matrix_rank(rows) < 3:
        return None
    return np.asarray(readings, float) @ np.linalg.pinv(rows).T


class AbstractUnitVector(AbstractSensor):
    """Unit vector to something known, in the sensor's axes."""

    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "channels 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Row k is the direction that column k reads."""

    @abstractmethod
    def target(self, view: View) -> Float[Array, "3"]:
        """The unit vector, body axes."""

    def __call__(self, view: View) -> Float[Array, " channels"]:
        return columns_of(self.axes, in_sensor(self.turn, self.target(view)))

    def noisy(self, reading: Float[Array, " channels"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " channels"]:
        """A unit vector again."""
        return unit_noise(reading, sigma, key)

    def direct(
        self, readings: Float[np.ndarray, "n channels"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]] | None:
        """Directions of it, NaN where the reading is no unit vector (`unit_readings`)."""
        read = vectors_of(readings, self.axes)
        if read is None:
            return None
        return directions_of(unit_readings(read, sigma) @ body_from_sensor(self.turn).T, sigma)


def signed_permutations(mirrored: bool) -> list[np.ndarray]:
    """The 24 right-handed matrices of signed axes, or all 48."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[np.arange(3), order] = signs
            if mirrored or np.linalg.det(matrix) > 0.0:
                found.append(matrix)
    return found


def axes_text(axes: np.ndarray) -> list[str]:
    """Rows of a signed permutation as `+x` ... `-z`."""
    return [PANEL_NAMES[2 * int(np.argmax(np.abs(row))) + int(row[np.argmax(np.abs(row))] < 0.0)] for row in axes]
