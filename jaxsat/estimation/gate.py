"""Which readings of an attitude may be believed: those that are no farther off than chance lets them be.

A squared innovation over the covariance that is expected of it is a chi-square where the filter is right; a reading
beyond the value that few right ones pass is refused (Bar-Shalom, Li & Kirubarajan 2001, sec. 5.4). Each reading is
judged by itself, before any of them has moved the belief.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float
from scipy.special import chdtri

from jaxsat.estimation.attitude_readings import AttitudeReadings, attitude, directions
from jaxsat.math import cross, inverse_3x3, quaternion

LEAST = 1e-12
"""Of the square of a cosine, below which two directions are opposite."""


def passing(
    q: Float[Array, "4"], covariance: Float[Array, "3 3"], readings: AttitudeReadings, probability: float
) -> tuple[Bool[Array, " readings"], Bool[Array, " readings"]]:
    """Which readings are there, and which of them pass: the directions, and last the attitude where there is a sensor.

    `q` is the attitude believed before the readings and `covariance` that of the rotation vector from it to the truth,
    body axes [rad^2]; `probability` is that of a right reading to pass.
    """
    body, eci, weight = directions(readings)
    there = weight > 0.0
    variance = jnp.where(there, 1.0 / jnp.where(there, weight, 1.0), 1.0)
    believed = quaternion.rotate_inverse(q, eci)
    squares = jax.vmap(_direction_square, in_axes=(0, 0, None, 0))(body, believed, covariance, variance)
    # Compared as not beyond: of a reading that is not there the square is no number.
    passed = there & ~(squares > chdtri(2, 1.0 - probability))
    seen = attitude(readings)
    if seen is None:
        return there, passed
    measured, weights, known = seen
    off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(q), measured))
    expected = covariance + jnp.diag(jnp.where(known, 1.0 / jnp.where(known, weights, 1.0), 1.0))
    near = off @ inverse_3x3(expected) @ off <= chdtri(3, 1.0 - probability)
    return jnp.append(there, known), jnp.append(passed, known & near)


def _direction_square(body, believed, covariance, variance):
    """Squared innovation of a direction over its covariance, of two degrees of freedom.

    With b measured and p believed, r = b x p is the rotation vector across p, of covariance M = P + sigma^2 in the
    plane across p, where r' M^-1 r = (p x r)' M (p x r) / (p' adj(M) p). Its length is the sine of the angle between
    the two, made their distance, so that what is opposite is far. Of a turn d that is large the direction leaves its
    tangent by d^2 / 2 at most, whose mean square is 3/4 tr(P)^2 at most: without it right readings are refused then.
    """
    spread = jnp.trace(covariance)
    variance = variance + 0.75 * spread**2
    M = covariance + variance * jnp.eye(3, dtype=covariance.dtype)
    cosine, beside = body @ believed, cross(believed, cross(body, believed))
    adjugate = jnp.stack([cross(M[1], M[2]), cross(M[2], M[0]), cross(M[0], M[1])])
    square = beside @ M @ beside / (believed @ adjugate @ believed)
    # The exact square is this at least, whatever the direction.
    least = (2.0 - 2.0 * cosine) / (spread + variance)
    return jnp.maximum(square / jnp.maximum(0.5 * (1.0 + cosine), LEAST), least)
