"""Sunlight mirrored by a spherical Earth: the reflection point and the strength of the reflected beam."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment.albedo.above_ground import above_ground
from jaxsat.math import angle_between, float_array, unit

# Newton on a function whose slope lies between 1 and 2 away from the surface: six steps reach 1e-16 for ratio > 1.01.
_ITERATIONS = 7
_SMALL_ANGLE = 1e-6


@jax.custom_jvp
def reflection_angle(alpha: Float[Array, ""], ratio: Float[Array, ""]) -> Float[Array, ""]:
    """Return Theta [rad], the angle at the Earth's centre from the Sun to the point that mirrors it to the satellite.

    Root of (r/R) sin(2 Theta - alpha) = sin Theta in (alpha/2, alpha), with alpha [rad, 0..pi] from the Sun to the
    satellite and `ratio` r/R > 1 (Penkov 2009, eq. 1), solved as alpha = 2 Theta - asin(sin(Theta) R/r), which is
    monotonic. Lit where Theta < pi/2, that is alpha < pi - asin(R/r).
    """
    theta = alpha * ratio / (2.0 * ratio - 1.0)
    for _ in range(_ITERATIONS):
        residual = 2.0 * theta - jnp.arcsin(jnp.sin(theta) / ratio) - alpha
        theta -= residual / _slope(theta, ratio)
    return theta


@reflection_angle.defjvp
def _reflection_angle_jvp(primals, tangents):
    alpha, ratio = primals
    d_alpha, d_ratio = tangents
    theta = reflection_angle(alpha, ratio)
    d_residual = jnp.sin(theta) / (ratio * jnp.sqrt(ratio**2 - jnp.sin(theta) ** 2)) * d_ratio
    return theta, (d_alpha - d_residual) / _slope(theta, ratio)


def _slope(theta, ratio):
    return 2.0 - jnp.cos(theta) / jnp.sqrt(ratio**2 - jnp.sin(theta) ** 2)


def specular_albedo(
    position_eci: Float[Array, "3"], sun_eci: Float[Array, "3"], radius: float | Float[Array, ""]
) -> tuple[Float[Array, "3"], Float[Array, ""]]:
    """Return the unit vector from the satellite toward the reflection point, and the beam over direct sunlight.

    Perfect mirror of `radius` [m], `sun_eci` a unit vector; rho the distance to the reflection point:
    factor = 1 / [(1 + 2 rho/(R cos Theta)) (1 + 2 rho cos(Theta)/R)], the limit for small polygons of Penkov (2009,
    section 3.5). Exactly zero beyond the mirror's terminator, where the direction is the nadir.
    Below the ground both are those at it.
    """
    position_eci = above_ground(position_eci, radius)
    distance = jnp.linalg.norm(position_eci)
    vertical = position_eci / distance
    alpha = angle_between(position_eci, sun_eci)
    ratio = distance / radius
    theta = reflection_angle(alpha, ratio)
    cosine = jnp.cos(theta)
    lit = cosine > 0.0
    # The weights of the two directions are even in alpha: below 1e-6 rad they are their limits to 1e-12.
    regular = lit & (alpha > _SMALL_ANGLE)
    sine_alpha = jnp.where(regular, jnp.sin(alpha), 1.0)
    on_vertical = jnp.where(regular, jnp.sin(theta) / sine_alpha, ratio / (2.0 * ratio - 1.0))
    on_sun = jnp.where(regular, jnp.sin(alpha - theta) / sine_alpha, (ratio - 1.0) / (2.0 * ratio - 1.0))
    point = unit(on_vertical * vertical + on_sun * sun_eci)
    to_point = jnp.where(lit, radius * point - position_eci, -position_eci)
    rho = jnp.linalg.norm(to_point) / radius
    safe_cosine = jnp.where(lit, cosine, 0.0)
    # The cosine is multiplied through, so that the factor goes to zero instead of dividing by it.
    factor = safe_cosine / ((safe_cosine + 2.0 * rho) * (1.0 + 2.0 * rho * safe_cosine))
    return unit(to_point), factor


class SpecularAlbedo(eqx.Module):
    """Perfect mirror sphere; the reflectivity is the panels' business, so that it can be fitted without the table."""

    radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_RADIUS_MEAN)
    """Radius of the mirror [m]."""

    def __call__(
        self, position_eci: Float[Array, "3"], sun_eci: Float[Array, "3"]
    ) -> tuple[Float[Array, "3"], Float[Array, ""]]:
        """Return direction toward the reflection point and factor of the beam, see `specular_albedo`."""
        return specular_albedo(position_eci, sun_eci, self.radius)
