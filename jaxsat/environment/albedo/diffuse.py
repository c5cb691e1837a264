"""Sunlight scattered by a Lambert Earth, as a fixed number of directions and weights to sum over."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment.albedo.above_ground import above_ground
from jaxsat.environment.albedo.reflectivity import AbstractReflectivity, UniformReflectivity
from jaxsat.math import float_array, unit

_GOLDEN = 0.6180339887498949


def diffuse_albedo(
    position_eci: Float[Array, "3"],
    sun_eci: Float[Array, "3"],
    radius: float | Float[Array, ""],
    rings: int,
    azimuths: int,
) -> tuple[Float[Array, "k 3"], Float[Array, "k"]]:
    """Return unit vectors toward patches of the lit Earth and their weights, for a Lambert sphere of reflectivity one.

    A panel of normal n has the current reflectivity * sum_k w_k max(0, n . d_k) over that of direct normal sunlight:
    the integral of mu_sun (n . d)/pi over the solid angle of the Earth (Lambert's law; Knocke 1988, section 2.1, with
    constant reflectivity). Rings are Gauss-Legendre nodes in the angle of emission, azimuths fill the lit arc of each
    ring. 10 x 20 agree with the full integral to 0.1 % of the best-placed panel's current, for any panel, and as well
    with weights times the reflectivity of Knocke's zones. Below the ground they are those at it.
    """
    directions, weights, _ = lit_patches(position_eci, sun_eci, radius, rings, azimuths)
    return directions, weights


def lit_patches(
    position_eci: Float[Array, "3"],
    sun_eci: Float[Array, "3"],
    radius: float | Float[Array, ""],
    rings: int,
    azimuths: int,
) -> tuple[Float[Array, "k 3"], Float[Array, "k"], Float[Array, "k 3"]]:
    """Return directions and weights of `diffuse_albedo`, and unit vectors from the Earth's centre to the patches."""
    position_eci = above_ground(position_eci, radius)
    distance = jnp.linalg.norm(position_eci)
    vertical = position_eci / distance
    ratio = distance / radius
    cos_alpha = jnp.dot(vertical, sun_eci)
    towards_sun, across = _horizontal_axes(vertical, sun_eci)
    sin_alpha = jnp.dot(towards_sun, sun_eci)

    # Emission angles z from the first ring that is not wholly dark to the limb; eta is the angle from the nadir.
    x, w = (jnp.asarray(c, position_eci.dtype)[:, None] for c in np.polynomial.legendre.leggauss(rings))
    first = _first_lit_emission_angle(cos_alpha, sin_alpha, ratio)
    half_span = 0.5 * (0.5 * jnp.pi - first)
    z = first + half_span * (x + 1.0)
    sin_eta = jnp.sin(z) / ratio
    cos_eta = jnp.sqrt(1.0 - sin_eta**2)
    central = z - jnp.arcsin(sin_eta)
    solid_angle = w * half_span * sin_eta * jnp.cos(z) / (ratio * cos_eta)

    # Cosine of the Sun's zenith distance along a ring: level + swing cos(azimuth); lit within half_arc of the Sun.
    level, swing = jnp.cos(central) * cos_alpha, jnp.sin(central) * sin_alpha
    half_arc = _lit_half_arc(level, swing)
    # Moving a node along the arc changes no integral: without the stop the derivative would grow at the terminator.
    node_arc = jax.lax.stop_gradient(half_arc)
    psi = node_arc * jnp.asarray(_azimuth_fractions(rings, azimuths), position_eci.dtype)
    sun_cosine = jnp.maximum(level + swing * jnp.cos(psi), 0.0)
    # The ring's flux is known in closed form; scaling to it removes the error of its kink at the terminator.
    flux = 2.0 * (level * half_arc + swing * jnp.sin(half_arc))
    total = jnp.sum(sun_cosine, axis=1, keepdims=True)
    share = jnp.where(total > 0.0, sun_cosine / jnp.where(total > 0.0, total, 1.0), 0.0)
    weights = share * flux * solid_angle / jnp.pi

    basis = jnp.stack([towards_sun, across, -vertical])
    local = jnp.stack([sin_eta * jnp.cos(psi), sin_eta * jnp.sin(psi), cos_eta * jnp.ones_like(psi)], axis=-1)
    directions = local.reshape(-1, 3) @ basis
    reach = jnp.repeat(ratio * cos_eta - jnp.cos(z), azimuths, axis=0)
    return directions, weights.reshape(-1), ratio * vertical[None, :] + reach * directions


def _horizontal_axes(vertical, sun_eci):
    """Horizontal unit vector toward the Sun's azimuth, any one with the Sun overhead, and the one across it."""
    horizontal = sun_eci - jnp.dot(sun_eci, vertical) * vertical
    defined = jnp.dot(horizontal, horizontal) > 1e-24
    least = jax.nn.one_hot(jnp.argmin(jnp.abs(vertical)), 3, dtype=vertical.dtype)
    towards_sun = unit(jnp.where(defined, horizontal, jnp.cross(vertical, least)))
    return towards_sun, jnp.cross(vertical, towards_sun)


def _first_lit_emission_angle(cos_alpha, sin_alpha, ratio):
    """Emission angle where the terminator crosses the Sun's vertical plane, 0 if the nadir is lit, at most pi/2."""
    # The terminator stands alpha - pi/2 from the nadir: sine and cosine of that are -cos(alpha) and sin(alpha).
    beyond = cos_alpha < 0.0
    angle = jnp.arctan2(jnp.where(beyond, -ratio * cos_alpha, 0.0), jnp.where(beyond, ratio * sin_alpha - 1.0, 1.0))
    return jnp.minimum(angle, 0.5 * jnp.pi)


def _lit_half_arc(level, swing):
    crossing = jnp.abs(level) < swing
    cosine = jnp.where(crossing, -level / jnp.where(crossing, swing, 1.0), 0.0)
    return jnp.where(crossing, jnp.arccos(cosine), jnp.where(level > 0.0, jnp.pi, 0.0))


def _azimuth_fractions(rings: int, azimuths: int) -> np.ndarray:
    """Equal steps in (-1, 1), turned from ring to ring by the golden ratio so that a panel's edge cuts no grid line."""
    turn = (np.arange(rings) * _GOLDEN) % 1.0
    return 2.0 * (np.arange(azimuths)[None, :] + turn[:, None]) / azimuths - 1.0


class DiffuseAlbedo(eqx.Module):
    """Lambert sphere seen as rings x azimuths directions; reflectivity one, or that of each patch."""

    radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_RADIUS_MEAN)
    """Radius of the sphere [m]."""
    rings: int = eqx.field(static=True, default=10)
    """Rings from the nadir to the limb."""
    azimuths: int = eqx.field(static=True, default=20)
    """Directions in each ring."""
    reflectivity: AbstractReflectivity = eqx.field(default_factory=UniformReflectivity)
    """Share of the light that each patch scatters; a common scale is the panels' business, where it can be fitted."""

    def __check_init__(self):
        if self.rings < 1 or self.azimuths < 3:
            raise ValueError(f"rings and azimuths must be at least 1 and 3, got {self.rings} and {self.azimuths}")

    def __call__(
        self, position_eci: Float[Array, "3"], sun_eci: Float[Array, "3"], t: float | Float[Array, ""] = 0.0
    ) -> tuple[Float[Array, "k 3"], Float[Array, "k"]]:
        """Return directions, and weights times the reflectivity at `t` [s], see `diffuse_albedo`."""
        directions, weights, ground = lit_patches(position_eci, sun_eci, self.radius, self.rings, self.azimuths)
        return directions, weights * self.reflectivity(ground, t)
