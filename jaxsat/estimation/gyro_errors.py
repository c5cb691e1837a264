"""What a gyro does to an attitude that is carried by it: white noise and a bias that walks (Farrenkopf 1978).

The reading is the rate, the bias and white noise; the bias is the integral of another white noise. Both are given by
their densities, as data sheets give them, so that nothing depends on how often the gyro is read. What a reading leaves
open over an interval follows in closed form for a rate that is constant in it, however fast (`carried_errors`).
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from jaxsat.math import float_array, is_known

_SMALL, _TERMS = 1.0, 8
"""Square of an angle [rad^2] below which the factors of it are series, and their terms: the next is under 1e-14."""


class GyroErrors(eqx.Module):
    """Noise of a gyro, alike about its three axes."""

    angle_random_walk: Float[Array, ""] = eqx.field(converter=float_array)
    """Density of the white noise [rad/s^0.5]: 1 deg/sqrt(h) is 2.9e-4. Noise of single readings of 1-sigma s, one each
    dt, is s sqrt(dt)."""
    rate_random_walk: Float[Array, ""] = eqx.field(converter=float_array, default=0.0)
    """Density of the noise that moves the bias [rad/s^1.5]."""

    def __check_init__(self):
        for name, value in vars(self).items():
            if is_known(value) and not np.all(np.isfinite(value) & (np.asarray(value) >= 0.0)):
                raise ValueError(f"GyroErrors: {name} must be a number of at least zero, got {value}")


def carried_errors(
    gyro: GyroErrors, rate: Float[Array, "3"], dt: float | Float[Array, ""]
) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
    """How an error of attitude (rotation vector, body axes [rad]) and bias [rad/s] goes on, and the covariance it gets.

    For a body that turns at the constant `rate` [rad/s] for `dt` [s]:

        transition = [[exp(-[wx] dt), -G(dt)], [0, 1]],  G(t) = integral of exp(-[wx] s) ds from 0 to t,
        covariance = [[v^2 dt + u^2 int G G^T, -u^2 int G], [-u^2 int G^T, u^2 dt]]

    with v and u the two densities. At rest these are the matrices of Farrenkopf (1978); Markley & Crassidis 2014,
    eqs. 6.82 to 6.93, have them to first order in the angle w dt, here they hold for any.
    """
    angle = dt * rate
    across = _cross_matrix(angle)
    square = across @ across
    one, two, three, four, five = _factors(angle @ angle)
    eye, zero = jnp.eye(3, dtype=angle.dtype), jnp.zeros((3, 3), angle.dtype)
    turn = eye - one * across + two * square
    mean = eye - two * across + three * square
    walked = dt * (0.5 * eye - three * across + four * square)
    spread = dt * (eye / 3.0 + five * square)
    v2, u2 = gyro.angle_random_walk**2, gyro.rate_random_walk**2
    transition = jnp.block([[turn, -dt * mean], [zero, eye]])
    covariance = jnp.block(
        [[v2 * dt * eye + u2 * dt**2 * spread, -u2 * dt * walked], [-u2 * dt * walked.T, u2 * dt * eye]]
    )
    return transition, covariance


def mean_turn(angle: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Mean of exp(-s [angle x]) over s from 0 to 1: the right Jacobian of a rotation vector [rad]."""
    across = _cross_matrix(angle)
    _, two, three, *_ = _factors(angle @ angle)
    return jnp.eye(3, dtype=angle.dtype) - two * across + three * across @ across


def gyro_reading(
    gyro: GyroErrors,
    rate: Float[Array, "3"],
    bias: Float[Array, "3"],
    dt: float | Float[Array, ""],
    *,
    key: Key[Array, ""],
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """A reading [rad/s] over an interval `dt` [s] of mean rate `rate`, and the bias at the interval's end.

    `bias` is that at its beginning. Both have exactly the noise whose covariance `carried_errors` has (Crassidis &
    Junkins 2012, eq. 7.143), with the rate that is constant in the interval.
    """
    white, walk = jax.random.normal(key, (2, 3), rate.dtype)
    after = bias + gyro.rate_random_walk * jnp.sqrt(dt) * walk
    sigma = jnp.sqrt(gyro.angle_random_walk**2 / dt + gyro.rate_random_walk**2 * dt / 12.0)
    return rate + 0.5 * (bias + after) + sigma * white, after


def _cross_matrix(v):
    x, y, z = v
    zero = jnp.zeros_like(x)
    return jnp.stack([jnp.stack([zero, -z, y]), jnp.stack([z, zero, -x]), jnp.stack([-y, x, zero])])


def _factors(square):
    """sin a/a, (1 - cos a)/a^2, (a - sin a)/a^3, (a^2/2 - 1 + cos a)/a^4, and (1/3 - 2 (a - sin a)/a^3)/a^2, of a^2."""
    small = square < _SMALL
    safe = jnp.where(small, 1.0, square)
    a = jnp.sqrt(safe)
    sine, cosine = jnp.sin(a), jnp.cos(a)
    two, three = (1.0 - cosine) / safe, (a - sine) / (safe * a)
    exact = (sine / a, two, three, (0.5 - two) / safe, (1.0 / 3.0 - 2.0 * three) / safe)
    series = (_series(square, first) for first in (1, 2, 3, 4))
    last = 2.0 * _series(square, 5)
    return tuple(jnp.where(small, s, e) for s, e in zip((*series, last), exact, strict=True))


def _series(square, first):
    """1/first! - a^2/(first + 2)! + a^4/(first + 4)! - ..."""
    terms = [(-1) ** k / math.factorial(first + 2 * k) for k in range(_TERMS)]
    found = jnp.full_like(square, terms[-1])
    for term in terms[-2::-1]:
        found = term + square * found
    return found
