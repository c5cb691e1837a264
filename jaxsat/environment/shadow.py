"""The Earth's shadow: a cylinder with a sharp edge, or the cone of a Sun of finite size with its penumbra."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import AU, EARTH_RADIUS_MEAN, SUN_RADIUS
from jaxsat.math import float_array, safe_norm, unit


def cylinder_illumination(
    position_eci: Float[Array, "3"], sun_eci: Float[Array, "3"], radius: float | Float[Array, ""]
) -> Float[Array, ""]:
    """Return 1 in sunlight and 0 in the cylinder of `radius` [m] behind the Earth; `sun_eci` is a unit vector.

    Exact and therefore without slope: its gradient is zero. The Earth is a sphere: its flattening, 21 km, moves the
    edges by a few seconds in a low orbit.
    """
    along = jnp.dot(position_eci, sun_eci)
    across = position_eci - along * sun_eci
    lit = (along >= 0.0) | (jnp.dot(across, across) >= radius**2)
    return lit.astype(position_eci.dtype)


def cone_illumination(
    position_eci: Float[Array, "3"],
    sun_eci: Float[Array, "3"],
    sun_distance: float | Float[Array, ""],
    *,
    radius: float | Float[Array, ""],
    sun_radius: float | Float[Array, ""],
) -> Float[Array, ""]:
    """Return the visible fraction of the Sun's disk, 0 in the umbra to 1 in full light (all lengths in m).

    Apparent radii a of the Sun and b of the Earth, c between their centres: 1 - lens(a, b, c)/(pi a^2)
    (Montenbruck & Gill 2000, eqs. 3.85-3.94), annular eclipse included. Flat disks instead of caps of the sky cost
    3e-4 of the light in low orbits, 3e-5 in the geostationary one. A spherical Earth without atmosphere; below its
    ground, as on it, it covers half of the sky.
    """
    to_sun = sun_distance * sun_eci - position_eci
    a = jnp.arcsin(sun_radius / jnp.linalg.norm(to_sun))
    distance = safe_norm(position_eci)
    above = distance > radius
    b = jnp.where(above, jnp.arcsin(radius / jnp.where(above, distance, 2.0 * radius)), 0.5 * jnp.pi)
    nadir, towards = unit(-position_eci), unit(to_sun)
    c = 2.0 * jnp.arctan2(safe_norm(nadir - towards), safe_norm(nadir + towards))
    return 1.0 - lens_area(a, b, c) / (jnp.pi * a**2)


@jax.custom_jvp
def lens_area(a: Float[Array, ""], b: Float[Array, ""], c: Float[Array, ""]) -> Float[Array, ""]:
    """Return the area common to two disks of radii a and b whose centres are c apart.

    The derivative is the exact one, arcs and chord of the lens: finite where the disks touch, unlike that of the
    formula's inverse cosines.
    """
    half_a, half_b, half_chord = _lens_shape(a, b, c)
    return a**2 * half_a + b**2 * half_b - c * half_chord


@lens_area.defjvp
def _lens_area_jvp(primals, tangents):
    a, b, c = primals
    half_a, half_b, half_chord = _lens_shape(a, b, c)
    area = a**2 * half_a + b**2 * half_b - c * half_chord
    da, db, dc = tangents
    return area, 2.0 * (a * half_a * da + b * half_b * db - half_chord * dc)


def _lens_shape(a, b, c):
    """Half-angles of the lens seen from each centre [rad], and half its chord; whole or no disk outside contact."""
    # Heron's product is exact near contact, where a^2 - x^2 would cancel.
    product = (a + b + c) * (a + b - c) * (c + a - b) * (c - a + b)
    crossing = product > 0.0
    safe_c = jnp.where(crossing, c, 1.0)
    half_chord = jnp.where(crossing, jnp.sqrt(jnp.where(crossing, product, 1.0)) / (2.0 * safe_c), 0.0)
    apart = c >= a + b
    # At contact the cosines below are +-1 with the right sign: an enclosed disk has half-angle pi, the other one 0.
    towards_b = jnp.where(crossing, (c**2 + a**2 - b**2) / (2.0 * safe_c), jnp.where(apart | (a > b), 1.0, -1.0))
    towards_a = jnp.where(crossing, (c**2 + b**2 - a**2) / (2.0 * safe_c), jnp.where(apart | (b >= a), 1.0, -1.0))
    return jnp.arctan2(half_chord, towards_b), jnp.arctan2(half_chord, towards_a), half_chord


class CylinderShadow(eqx.Module):
    """Parallel sunlight and a sharp edge: illumination exactly 0 or 1."""

    radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_RADIUS_MEAN)
    """Radius of the cylinder [m]."""

    def __call__(self, position_eci: Float[Array, "3"], sun_eci: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the illumination at an inertial position [m] for a unit vector to the Sun."""
        return cylinder_illumination(position_eci, sun_eci, self.radius)


class ConeShadow(eqx.Module):
    """A Sun of finite size: penumbra as the visible fraction of its disk, with a slope that a fit can follow."""

    sun_distance: Float[Array, ""] = eqx.field(converter=float_array, default=AU)
    """Distance of the Sun from the Earth [m]; sets the width of the penumbra (+-1.7 % over the year)."""
    radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_RADIUS_MEAN)
    """Radius of the Earth [m]."""
    sun_radius: Float[Array, ""] = eqx.field(converter=float_array, default=SUN_RADIUS)
    """Radius of the Sun [m]."""

    def __call__(self, position_eci: Float[Array, "3"], sun_eci: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the illumination at an inertial position [m] for a unit vector to the Sun."""
        return cone_illumination(
            position_eci, sun_eci, self.sun_distance, radius=self.radius, sun_radius=self.sun_radius
        )
