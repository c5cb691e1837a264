"""Attitude from the Sun in body axes and two or three magnetometers (`OrSB` of Penkov et al. 2009, sec. 3.3)."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxsat.estimation.vectors import rotation_covariance, two_vector_attitude
from jaxsat.math import angle_between, safe_norm, unit

STATUSES = (
    "solved",
    "the Sun is along the field: the turn about it is not seen",
    "no direction of the Sun",
    "fewer than two magnetometer axes read",
    "the third axis may have either sign: two attitudes agree with the Sun",
    "two axes read more than the whole field",
)
SOLVED, ALONG, NO_SUN, NO_FIELD, TWO_SIGNS, TOO_STRONG = range(6)
LEAST_ANGLE = jnp.radians(1.0).item()
"""Sun and field nearer to one line than this give no attitude [rad]."""
SIGN_CHI2 = 9.0
"""Signs of an axis that is not measured are told apart where their mismatch with the Sun differs by this, 3 sigma."""


class SunFieldFit(eqx.Module):
    """Attitudes of one sample, the better first; with three axes measured both are the same."""

    quaternion: Float[Array, "2 4"]
    """inertial-from-body; meaningless where `status` says that there is none."""
    field_body: Float[Array, "2 3"]
    """The field with the missing component filled in [T]."""
    mismatch: Float[Array, "2"]
    """Angle between Sun and field in the body less that outside [rad]."""
    covariance: Float[Array, "2 3 3"]
    """Of a small rotation about the body axes [rad^2]."""
    status: Int[Array, ""]
    """Place in `STATUSES`."""


def sun_and_field_attitude(
    sun_body: Float[Array, "3"],
    field_body: Float[Array, "3"],
    sun_eci: Float[Array, "3"],
    b_field_eci: Float[Array, "3"],
    sun_sigma: Float[Array, ""],
    field_sigma: Float[Array, ""],
) -> SunFieldFit:
    """Attitude of least squares from a unit vector to the Sun and the field [T], NaN for an axis that is not measured.

    With one axis missing its size follows from the field's modulus and its sign from the angle between Sun and field:
    two candidates, both returned. Each direction weighs by its error: `sun_sigma` [rad] and `field_sigma` [T] over the
    modulus. A Sun of zeros or NaN stands for none.
    """
    modulus = safe_norm(b_field_eci)
    measured = ~jnp.isnan(field_body)
    axes = jnp.sum(measured)
    known = jnp.where(measured, field_body, 0.0)
    has_sun = jnp.all(jnp.isfinite(sun_body)) & (jnp.sum(jnp.where(jnp.isfinite(sun_body), sun_body, 0.0) ** 2) > 0.0)
    sun = unit(jnp.where(has_sun, sun_body, jnp.array([1.0, 0.0, 0.0], dtype=known.dtype)))
    left = modulus**2 - known @ known
    missing = jnp.where(left > 0.0, jnp.sqrt(jnp.where(left > 0.0, left, 1.0)), 0.0)
    to_sun = angle_between(sun_eci, b_field_eci)
    sigmas = jnp.stack([sun_sigma, field_sigma / modulus])

    def candidate(sign):
        field = jnp.where(measured, known, sign * missing)
        body = jnp.stack([sun, unit(field)])
        attitude = two_vector_attitude(body, jnp.stack([sun_eci, unit(b_field_eci)]), 1.0 / sigmas**2)
        return attitude, field, angle_between(sun, field) - to_sun, rotation_covariance(body, sigmas)

    found = jax.vmap(candidate)(jnp.array([1.0, -1.0], dtype=known.dtype))
    swap = jnp.abs(found[2][1]) < jnp.abs(found[2][0])
    attitude, field, mismatch, covariance = jax.tree.map(lambda leaf: jnp.where(swap, leaf[::-1], leaf), found)
    apart = (mismatch[1] ** 2 - mismatch[0] ** 2) / jnp.sum(sigmas**2)
    aligned = jnp.sin(angle_between(sun, field[0])) < jnp.sin(LEAST_ANGLE)
    aligned |= jnp.sin(to_sun) < jnp.sin(LEAST_ANGLE)
    two = axes == 2
    checks = [
        (~has_sun, NO_SUN),
        (axes < 2, NO_FIELD),
        # Noise alone can do this where the field lies in the plane of the two axes.
        (two & (left < -6.0 * field_sigma * modulus), TOO_STRONG),
        (aligned, ALONG),
        (two & (missing > 0.0) & (apart < SIGN_CHI2), TWO_SIGNS),
    ]
    status = jnp.select([condition for condition, _ in checks], [jnp.asarray(code) for _, code in checks], SOLVED)
    return SunFieldFit(attitude, field, mismatch, covariance, status)
