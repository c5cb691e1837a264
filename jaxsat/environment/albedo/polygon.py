"""Sunlight mirrored by a spherical Earth onto a polygon of any size, corner by corner."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.environment.albedo.above_ground import above_ground
from jaxsat.environment.albedo.specular import reflection_angle
from jaxsat.math import angle_between, cross

# Newton from zero: n steps leave the (2^n - 1)th power of a corner's offset over the path, four 1e-15 up to a tenth.
_ITERATIONS = 4


def mirrored_area(
    position_eci: Float[Array, "3"],
    corners_eci: Float[Array, "k 3"],
    sun_eci: Float[Array, "3"],
    radius: float | Float[Array, ""],
) -> Float[Array, ""]:
    """Return the area across the Sun's rays of the sunlight that a perfect mirror of `radius` throws on a panel [m^2].

    The panel is a polygon with `corners_eci` [m] relative to `position_eci` [m], counter-clockwise seen from its
    working side; `sun_eci` is a unit vector. Each corner is mapped along its reflected ray to the plane across the
    rays of the Sun, where the area of the polygon is taken, its sides straight (Penkov 2009, section 3.5, `mirrKub`).
    Light from behind maps with the other orientation and counts as zero, as does all of it where `position_eci` lies
    beyond the mirror's terminator. Straight sides cost 6e-8 of the area for 1 km seen from 400 km, as the square of
    the size (more corners along the sides cure it); a panel of L metres that straddles the terminator loses at most
    1.2e-8 L of direct sunlight. Raise ValueError for fewer than three corners.
    """
    if corners_eci.shape[0] < 3:
        raise ValueError(f"corners_eci must be at least three corners of a polygon, got {corners_eci.shape[0]}")
    p, corners, sun = above_ground(position_eci, radius) / radius, corners_eci / radius, sun_eci
    square = p @ p
    cosine = jnp.cos(reflection_angle(angle_between(p, sun), jnp.sqrt(square)))
    lit = cosine > 0.0
    # Beyond the terminator the equations lose their sense: any lit place keeps them and their derivatives finite.
    p, cosine = jnp.where(lit, p, jnp.sqrt(square) * sun), jnp.where(lit, cosine, 1.0)
    feet = jax.vmap(_moved_reflection_point, (0, None, None, None))(corners, p, sun, cosine)
    # Triangles from the first corner; the sign is that of light falling from the front.
    sides = feet[1:] - feet[:1]
    signed = -0.5 * jnp.sum(cross(sides[:-1], sides[1:]) @ sun)
    return jnp.where(lit, jnp.maximum(signed, 0.0), 0.0) * radius**2


def _moved_reflection_point(corner, p, sun, cosine):
    """By how much the reflection point moves when the satellite does by `corner`; lengths in radii of the mirror.

    Every term is proportional to the offset, nothing of the size of the Earth is subtracted: a corner of 0.1 m keeps
    all its digits. p = m + t (2 cosine m - sun), with t the length of the reflected path and m the normal of the mirror
    where it is reflected, gives (|p|^2 - t^2) m = p + t sun, so that w^2 = |p + t sun|^2 with w = |p|^2 - t^2.
    """
    square, z = p @ p, p @ sun
    t = (square - 1.0) / (cosine + jnp.sqrt(square - 1.0 + cosine**2))
    w = square - t**2
    d_square, d_z = 2.0 * (corner @ p) + corner @ corner, corner @ sun
    d_t = _path_change(d_square, d_z, t, w, z)
    d_w = d_square - d_t * (2.0 * t + d_t)
    return (corner + d_t * sun - d_w / w * (p + t * sun)) / (w + d_w)


@jax.custom_jvp
def _path_change(d_square, d_z, t, w, z):
    """Change of t that keeps w^2 = |p + t sun|^2 when |p|^2 and z = p . sun change by `d_square` and `d_z`."""
    d_t = jnp.zeros_like(t)
    for _ in range(_ITERATIONS):
        d_w = d_square - d_t * (2.0 * t + d_t)
        residual = d_w * (2.0 * w + d_w) - d_square - 2.0 * (t * d_z + d_t * (z + d_z)) - d_t * (2.0 * t + d_t)
        d_t += residual / _slope(d_t, d_w, d_z, t, w, z)
    return d_t


@_path_change.defjvp
def _path_change_jvp(primals, tangents):
    d_square, d_z, t, w, z = primals
    d_square_dot, d_z_dot, t_dot, w_dot, z_dot = tangents
    d_t = _path_change(d_square, d_z, t, w, z)
    d_w = d_square - d_t * (2.0 * t + d_t)
    change = (2.0 * (w + d_w) - 1.0) * d_square_dot - 2.0 * (t + d_t) * d_z_dot
    change += 2.0 * (d_w * w_dot - d_t * z_dot - (d_z + d_t + 2.0 * d_t * (w + d_w)) * t_dot)
    return d_t, change / _slope(d_t, d_w, d_z, t, w, z)


def _slope(d_t, d_w, d_z, t, w, z):
    """Minus the derivative of the residual by `d_t`."""
    return 4.0 * (w + d_w) * (t + d_t) + 2.0 * (z + d_z + t + d_t)


def polygon_area(corners: Float[Array, "k 3"]) -> Float[Array, ""]:
    """Return the area of a flat polygon, in the square of the corners' unit."""
    sides = corners[1:] - corners[:1]
    return 0.5 * jnp.linalg.norm(jnp.sum(cross(sides[:-1], sides[1:]), axis=0))


def polygon_specular_albedo(
    position_eci: Float[Array, "3"],
    corners_eci: Float[Array, "k 3"],
    sun_eci: Float[Array, "3"],
    radius: float | Float[Array, ""],
) -> Float[Array, ""]:
    """Return the panel's current from a mirror Earth over that of direct normal sunlight, see `mirrored_area`.

    For a small panel it tends to the factor of `specular_albedo` times the cosine between its normal and the direction
    toward the reflection point.
    """
    return mirrored_area(position_eci, corners_eci, sun_eci, radius) / polygon_area(corners_eci)
