"""Three magnetorquers: from the torque that is wanted to the dipole that is switched on (Somov 2018, section 4)."""

import math

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross, safe_norm

DUTY_COSINE = 1.0 / math.sqrt(2.0)
"""Cosine of the angle between wanted torque and field beyond which most of the torque cannot be had."""


def saturated(x: Float[Array, "3"], limit: float | Float[Array, ""]) -> Float[Array, "3"]:
    """`x` with no component beyond `limit`, its direction kept: the function SC of Somov 2018, section 4."""
    most = jnp.maximum(jnp.maximum(jnp.abs(x[0]), jnp.abs(x[1])), jnp.abs(x[2]))
    return x * jnp.where(most > limit, limit / jnp.where(most > 0.0, most, 1.0), 1.0)


def actuator_dipole(
    torque_body: Float[Array, "3"],
    b_field_body: Float[Array, "3"],
    max_dipole: float | Float[Array, ""],
    *,
    duty_cosine: float | Float[Array, ""] = DUTY_COSINE,
) -> Float[Array, "3"]:
    """Dipole [A m^2] of three coils that gives what lies across the field [T] of a wanted torque [N m].

    L = SC((b x M) / B, `max_dipole`), so that L x B is M less its part along the field (Somov 2018, eq. 4; with the
    sign of eq. 5 as printed it would be the opposite). Zero where M stands closer to the field than the `duty_cosine`
    allows; the paper tests M after its part along the field is taken away, and so never.
    """
    strength = safe_norm(b_field_body)
    b = b_field_body / jnp.where(strength > 0.0, strength, 1.0)
    along = jnp.sum(b * torque_body)
    off = (along**2 > duty_cosine**2 * jnp.sum(torque_body**2)) | (strength <= 0.0)
    dipole = saturated(cross(b, torque_body) / jnp.where(strength > 0.0, strength, 1.0), max_dipole)
    return jnp.where(off, 0.0, dipole)
