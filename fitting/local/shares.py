"""How much of six currents is direct sunlight and how much comes from the Earth, at a given attitude."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.environment import LightTable
from jaxsat.sensors.solar_panels import Albedo, albedo_currents, direct_currents
from jaxsat.spacecraft import SolarPanels

Limit = Float[Array, ""] | None
"""Largest albedo factor over the direct one; None where any is allowed."""
Numbers = Float[Array, "*batch"]


class LocalFit(eqx.Module):
    """Attitudes that explain one sample, each with its two factors."""

    quaternion: Float[Array, "*found 4"]
    """inertial-from-body."""
    rms: Float[Array, "*found"]
    """Of measured - modelled currents [A]."""
    direct: Float[Array, "*found"]
    """Fitted factor of the direct current."""
    albedo: Float[Array, "*found"]
    """Fitted factor of the current of an Earth of reflectivity one."""


def mirror_earth() -> Albedo:
    """Pattern of the published programs: an Earth that is a perfect mirror."""
    return Albedo(jnp.asarray(1.0), jnp.asarray(0.0))


def mirror_light(light: LightTable) -> LightTable:
    """The same light without the patches of diffuse light, of which a mirror has none: they would be summed for 0."""
    return eqx.tree_at(
        lambda t: (t.diffuse_direction_eci, t.diffuse_weight),
        light,
        (light.diffuse_direction_eci[..., :0, :], light.diffuse_weight[..., :0]),
    )


def nonnegative_factors(
    first: Float[Array, " n"], second: Float[Array, " n"], measured: Float[Array, " n"]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Least-squares factors >= 0 of two known patterns; see `factors_from_products`."""
    return factors_from_products(first @ first, first @ second, second @ second, first @ measured, second @ measured)


def factors_from_products(ff: Numbers, fs: Numbers, ss: Numbers, fm: Numbers, sm: Numbers) -> tuple[Numbers, Numbers]:
    """Factors >= 0 of least |a f + b s - m|^2 from the scalar products of f, s and m.

    The problem of Lawson & Hanson (1974, ch. 23), in closed form for two unknowns: the quadratic is convex, so the
    minimum is the free one or lies on one of the two edges. Zero for a pattern of zeros; of two parallel patterns the
    one that explains more, the first if both do alike.
    """

    def alone(square, product):
        present = square > 0.0
        return jnp.where(present, jnp.maximum(product, 0.0) / jnp.where(present, square, 1.0), 0.0)

    determinant = ff * ss - fs * fs
    regular = determinant > 1e-12 * ff * ss
    safe = jnp.where(regular, determinant, 1.0)
    a, b = (ss * fm - fs * sm) / safe, (ff * sm - fs * fm) / safe
    inside = regular & (a >= 0.0) & (b >= 0.0)
    a_alone, b_alone = alone(ff, fm), alone(ss, sm)
    # What a lone pattern p explains of the squares is factor * (p . measured).
    second_better = b_alone * sm > a_alone * fm
    return (
        jnp.where(inside, a, jnp.where(second_better, 0.0, a_alone)),
        jnp.where(inside, b, jnp.where(second_better, b_alone, 0.0)),
    )


def bounded_factors(
    direct: Float[Array, " n"], albedo: Float[Array, " n"], measured: Float[Array, " n"], max_albedo: Limit
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Least-squares factors of two known current patterns, with 0 <= albedo <= max_albedo * direct.

    Where nothing is direct, as in shadow, the factor of the direct light only bounds that of the albedo.
    """
    if max_albedo is None:
        return nonnegative_factors(direct, albedo, measured)
    # The cone of the allowed factors is spanned by (1, 0) and (1, max_albedo).
    low, high = nonnegative_factors(direct, direct + max_albedo * albedo, measured)
    return low + high, max_albedo * high


def patterns(
    q_inertial_from_body: Float[Array, "4"], panels: SolarPanels, earth: Albedo, light: LightTable
) -> tuple[Float[Array, " panels"], Float[Array, " panels"]]:
    """Currents of direct sunlight and of light returned by `earth` [A], before any factor."""
    return (
        direct_currents(q_inertial_from_body, panels, light),
        albedo_currents(q_inertial_from_body, panels, earth, light),
    )


def explained(
    q_inertial_from_body: Float[Array, "4"],
    measured: Float[Array, " panels"],
    panels: SolarPanels,
    earth: Albedo,
    light: LightTable,
    max_albedo: Limit,
) -> LocalFit:
    """The factors that explain the currents [A] best at one attitude, and what they leave."""
    direct, albedo = patterns(q_inertial_from_body, panels, earth, light)
    a, b = bounded_factors(direct, albedo, measured, max_albedo)
    rms = jnp.sqrt(jnp.mean((a * direct + b * albedo - measured) ** 2))
    return LocalFit(q_inertial_from_body, rms, a, b)
