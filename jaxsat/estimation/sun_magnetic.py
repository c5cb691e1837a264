"""Attitude by Sun-magnetic angles: how far body x is from the field, to which side of the Sun, and the roll about x.

The program `Orfs` gives such angles (Penkov et al. 2009, section 3.8) without formulas; the definitions here are ours.
Sun-magnetic axes: x along the field, y on the Sun's side of it, z along field x Sun. The turn from them to the body
is split into the shortest one that takes x to body x (deviation and its azimuth) and a roll about x, so that the roll
means the same for any small deviation, where the angles of Euler have none of their own.
Each function takes one attitude; batch with `jax.vmap`.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import angle_between, cross, quaternion, unit


def sun_magnetic_axes(b_field_eci: Float[Array, "3"], sun_eci: Float[Array, "3"]) -> Float[Array, "4"]:
    """Quaternion that turns Sun-magnetic components into inertial ones; field and Sun of any length.

    With the Sun along the field, within 1e-8 of it, the inertial axis least along the field stands in its place.
    """
    x, sun = unit(b_field_eci), unit(sun_eci)
    across = cross(x, sun)
    defined = jnp.sum(across * across) > 1e-16
    least = jnp.eye(3, dtype=x.dtype)[jnp.argmin(jnp.abs(x))]
    z = unit(cross(x, jnp.where(defined, sun, least)))
    return quaternion.from_dcm(jnp.stack([x, cross(z, x), z], axis=1))


def sun_magnetic_angles(
    q_inertial_from_body: Float[Array, "4"], b_field_eci: Float[Array, "3"], sun_eci: Float[Array, "3"]
) -> Float[Array, "3"]:
    """Deviation of body x from the field in [0, pi], azimuth of the deviation and roll about x in (-pi, pi] [rad].

    The azimuth is counted about the field from the Sun's side. It is zero where there is no deviation, the roll where
    body x points against the field: there these angles do not exist, and their derivatives are zero too.
    """
    q = quaternion.multiply(quaternion.conjugate(sun_magnetic_axes(b_field_eci, sun_eci)), q_inertial_from_body)
    x, y, z = quaternion.to_dcm(q)[:, 0]
    deviation = angle_between(jnp.stack([x, y, z]), jnp.array([1.0, 0.0, 0.0], dtype=q.dtype))
    return jnp.stack([deviation, _angle(z, y), 2.0 * _half_turn(q)])


def attitude_from_sun_magnetic(
    angles: Float[Array, "3"], b_field_eci: Float[Array, "3"], sun_eci: Float[Array, "3"]
) -> Float[Array, "4"]:
    """Attitude, inertial-from-body, of deviation, azimuth and roll [rad]: the inverse of `sun_magnetic_angles`."""
    deviation, azimuth, roll = angles
    zero = jnp.zeros_like(roll)
    swing = deviation * jnp.stack([zero, -jnp.sin(azimuth), jnp.cos(azimuth)])
    turn = jnp.stack([roll, zero, zero])
    body = quaternion.multiply(quaternion.from_rotation_vector(swing), quaternion.from_rotation_vector(turn))
    return quaternion.multiply(sun_magnetic_axes(b_field_eci, sun_eci), body)


def _half_turn(q: Float[Array, "4"]) -> Float[Array, ""]:
    """Half the roll about x, in (-pi/2, pi/2]: either sign of a quaternion is the same attitude."""
    back = (q[0] < 0.0) | ((q[0] == 0.0) & (q[1] < 0.0))
    return _angle(jnp.where(back, -q[1], q[1]), jnp.where(back, -q[0], q[0]))


def _angle(y: Float[Array, ""], x: Float[Array, ""]) -> Float[Array, ""]:
    pole = x * x + y * y <= jnp.finfo(x.dtype).eps ** 2
    return jnp.arctan2(jnp.where(pole, 0.0, y), jnp.where(pole, 1.0, x))
