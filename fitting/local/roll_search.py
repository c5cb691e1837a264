"""Local method of `OrbfiGraf` (Penkov et al. 2009, sec. 3.2): attitude of single samples with x along the field.

The satellite's x axis is assumed to lie along the magnetic field, in one of the two directions. For each roll about it
the currents are explained by a direct and an albedo part, the albedo bounded; the roll that explains them best wins.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.environment import LightTable
from jaxsat.math import cross, quaternion, unit
from jaxsat.sensors.solar_panels import Albedo, albedo_currents, direct_currents
from jaxsat.spacecraft import SolarPanels


class RollFit(eqx.Module):
    """Best rolls of one sample, the best first."""

    quaternion: Float[Array, "*rolls 4"]
    """inertial-from-body with x along the field (or against it)."""
    rms: Float[Array, "*rolls"]
    """Of measured - modelled currents [A]."""
    direct: Float[Array, "*rolls"]
    """Fitted factor of the direct current."""
    albedo: Float[Array, "*rolls"]
    """Fitted specular factor, in [0, max_albedo] of the direct one."""


def field_aligned(b_field_eci: Float[Array, "3"], roll: Float[Array, ""], sign: Float[Array, ""]) -> Float[Array, "4"]:
    """Attitude with body x along `sign` times the field and turned by `roll` about it."""
    x = sign * unit(b_field_eci)
    # The reference for the roll is the inertial axis least along the field, so it is never parallel to it.
    y = unit(cross(jnp.eye(3, dtype=x.dtype)[jnp.argmin(jnp.abs(x))], x))
    z = cross(x, y)
    base = quaternion.from_dcm(jnp.stack([x, y, z], axis=1))
    half = 0.5 * roll
    about_x = jnp.stack([jnp.cos(half), jnp.sin(half), jnp.zeros_like(half), jnp.zeros_like(half)])
    return quaternion.multiply(base, about_x)


def bounded_factors(
    direct: Float[Array, "6"], albedo: Float[Array, "6"], measured: Float[Array, "6"], max_albedo: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Least-squares factors of two known current patterns, with 0 <= albedo <= max_albedo * direct.

    The quadratic is convex in two unknowns, so the minimum is the free one or lies on one of the two edges.
    """

    def along(pattern):
        return jnp.maximum(pattern @ measured, 0.0) / jnp.maximum(pattern @ pattern, 1e-30)

    dd, da, aa = direct @ direct, direct @ albedo, albedo @ albedo
    determinant = dd * aa - da * da
    regular = determinant > 1e-12 * dd * aa
    safe = jnp.where(regular, determinant, 1.0)
    free_direct = (aa * (direct @ measured) - da * (albedo @ measured)) / safe
    free_albedo = (dd * (albedo @ measured) - da * (direct @ measured)) / safe
    inside = regular & (free_albedo >= 0.0) & (free_direct > 0.0) & (free_albedo <= max_albedo * free_direct)
    edge_low = along(direct)
    edge_high = along(direct + max_albedo * albedo)

    def misfit(a, b):
        return jnp.sum((a * direct + b * albedo - measured) ** 2)

    high_better = misfit(edge_high, max_albedo * edge_high) < misfit(edge_low, jnp.zeros_like(edge_low))
    edge = jnp.where(high_better, edge_high, edge_low)
    edge_albedo = jnp.where(high_better, max_albedo * edge_high, 0.0)
    return jnp.where(inside, free_direct, edge), jnp.where(inside, free_albedo, edge_albedo)


def search_roll(
    measured: Float[Array, "6"],
    b_field_eci: Float[Array, "3"],
    panels: SolarPanels,
    light: LightTable,
    max_albedo: Float[Array, ""],
    *,
    rolls: int = 90,
    keep: int = 4,
) -> RollFit:
    """The `keep` best of `rolls` evenly spaced rolls in both directions of x, each with its bounded albedo.

    A start for a fit needs no finer roll than 4 deg.
    """
    unit_albedo = Albedo(jnp.ones_like(max_albedo), jnp.zeros_like(max_albedo))
    angles = 2.0 * jnp.pi * jnp.arange(rolls, dtype=measured.dtype) / rolls

    def at(roll, sign):
        q = field_aligned(b_field_eci, roll, sign)
        direct = direct_currents(q, panels, light)
        reflected = albedo_currents(q, panels, unit_albedo, light)
        factor, albedo = bounded_factors(direct, reflected, measured, max_albedo)
        rms = jnp.sqrt(jnp.mean((factor * direct + albedo * reflected - measured) ** 2))
        return RollFit(q, rms, factor, albedo)

    one_way = jax.vmap(at, in_axes=(0, None))
    found = jax.tree.map(
        lambda a, b: jnp.concatenate([a, b]), one_way(angles, jnp.asarray(1.0)), one_way(angles, jnp.asarray(-1.0))
    )
    best = jnp.argsort(found.rms)[:keep]
    return jax.tree.map(lambda leaf: leaf[best], found)
