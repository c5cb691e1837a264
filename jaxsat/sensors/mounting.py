"""How a sensor sits in its satellite: by a small turn of its axes, and by the directions that its columns read."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import quaternion

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
