"""What the sensors of an attitude filter say, and what of it counts."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.math import quaternion, unit


class AttitudeReadings(eqx.Module):
    """What the sensors say at one time. What is not known is a drop-out, and may be anything, NaN too."""

    rate: Float[Array, "3"]
    """Of the gyro, body axes [rad/s]: the mean since the last update, as a gyro that integrates gives it. A reading of
    the moment may stand for it where the rate hardly changes in between."""
    body: Float[Array, "vectors 3"]
    """Directions in body axes as measured, of any length: Sun, field, stars."""
    eci: Float[Array, "vectors 3"]
    """The same in inertial axes as known."""
    sigma: Float[Array, " vectors"]
    """1-sigma of each measured direction about each axis across it [rad]."""
    known: Bool[Array, " vectors"]
    """Which are measured. One with a number that is not finite, of length or sigma zero, is not in any case."""
    attitude: Float[Array, "4"] | None = None
    """Quaternion from body to inertial axes, as a star tracker gives it; None where there is no such sensor."""
    attitude_sigma: Float[Array, "3"] | None = None
    """1-sigma of it about each body axis [rad]."""
    attitude_known: Bool[Array, ""] | None = None


def directions(
    readings: AttitudeReadings,
) -> tuple[Float[Array, "vectors 3"], Float[Array, "vectors 3"], Float[Array, " vectors"]]:
    """Unit vectors inside and outside, and the weights 1/sigma^2, zero and a finite vector for what is not known."""
    body, eci, sigma = readings.body, readings.eci, readings.sigma
    finite = jnp.all(jnp.isfinite(body) & jnp.isfinite(eci), axis=1)
    known = readings.known & finite & jnp.isfinite(sigma) & (sigma > 0.0)
    body, eci = (jnp.where(known[:, None], v, 0.0) for v in (body, eci))
    known = known & jnp.any(body != 0.0, axis=1) & jnp.any(eci != 0.0, axis=1)
    weight = jnp.where(known, 1.0 / jnp.where(known, sigma, 1.0) ** 2, 0.0)
    return unit(body), unit(eci), weight


def attitude(readings: AttitudeReadings) -> tuple[Float[Array, "4"], Float[Array, "3"], Bool[Array, ""]] | None:
    """Unit quaternion, weights 1/sigma^2 [3] and whether it is known; the identity where not, None without a sensor."""
    q, sigma = readings.attitude, readings.attitude_sigma
    if q is None or sigma is None:
        return None
    known = jnp.all(jnp.isfinite(q)) & jnp.any(q != 0.0) & jnp.all(jnp.isfinite(sigma) & (sigma > 0.0))
    if readings.attitude_known is not None:
        known = known & readings.attitude_known
    identity = jnp.array([1.0, 0.0, 0.0, 0.0], q.dtype)
    weights = jnp.where(known, 1.0 / jnp.where(known, sigma, 1.0) ** 2, 0.0)
    return quaternion.normalize(jnp.where(known, q, identity)), weights, known
