"""Local method of `OrbfiGraf` (Penkov et al. 2009, sec. 3.2): attitude of single samples with x along the field.

The satellite's x axis is assumed to lie along the magnetic field, in one of the two directions. For each roll about it
the currents are explained by a direct and an albedo part, the albedo bounded; the roll that explains them best wins.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.local.shares import LocalFit, bounded_factors, explained, mirror_earth
from fitting.local.turn import panel_sinusoids
from jaxsat.environment import LightTable
from jaxsat.math import cross, quaternion, unit
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.spacecraft import SolarPanels

COARSE_ROLLS = 72
"""Rolls of the first turn: steps of 5 deg are well below the 90 deg between two panels."""
LEVELS, POINTS = 6, 9
"""Each finer scan covers one step of the last to both sides with `POINTS` rolls: 6 of them end at 0.001 deg."""


BOTH = (1.0, -1.0)
"""Body x along the field and against it."""


class RollMinima(eqx.Module):
    """Rolls that explain one sample, the best first; where there are fewer, the rest have an infinite rms."""

    fit: LocalFit
    along: Float[Array, "*found"]
    """+1 with body x along the field, -1 against it."""
    information: Float[Array, "*found"]
    """Square of the residuals' slope by the roll, the factors following [A^2/rad^2]: sigma is noise over its root."""


def field_aligned(b_field_eci: Float[Array, "3"], roll: Float[Array, ""], sign: Float[Array, ""]) -> Float[Array, "4"]:
    """Attitude with body x along `sign` times the field and turned by `roll` about it."""
    x = sign * unit(b_field_eci)
    # The reference for the roll is the inertial axis least along the field, so it is never parallel to it.
    y = unit(cross(jnp.eye(3, dtype=x.dtype)[jnp.argmin(jnp.abs(x))], x))
    z = cross(x, y)
    base = quaternion.from_dcm(jnp.stack([x, y, z], axis=1))
    return quaternion.multiply(base, _about_x(roll))


def _about_x(roll):
    half = 0.5 * roll
    return jnp.stack([jnp.cos(half), jnp.sin(half), jnp.zeros_like(half), jnp.zeros_like(half)])


def search_roll(
    measured: Float[Array, "6"],
    b_field_eci: Float[Array, "3"],
    panels: SolarPanels,
    light: LightTable,
    max_albedo: Float[Array, ""],
    *,
    rolls: int = 90,
    keep: int = 4,
) -> LocalFit:
    """The `keep` best of `rolls` evenly spaced rolls in both directions of x, each with its bounded albedo.

    A start for a fit needs no finer roll than 4 deg.
    """
    earth = mirror_earth()
    angles = 2.0 * jnp.pi * jnp.arange(rolls, dtype=measured.dtype) / rolls

    def at(roll, sign):
        return explained(field_aligned(b_field_eci, roll, sign), measured, panels, earth, light, max_albedo)

    one_way = jax.vmap(at, in_axes=(0, None))
    found = jax.tree.map(
        lambda a, b: jnp.concatenate([a, b]), one_way(angles, jnp.asarray(1.0)), one_way(angles, jnp.asarray(-1.0))
    )
    best = jnp.argsort(found.rms)[:keep]
    return jax.tree.map(lambda leaf: leaf[best], found)


def roll_minima(
    measured: Float[Array, "6"],
    b_field_eci: Float[Array, "3"],
    panels: SolarPanels,
    earth: Albedo,
    light: LightTable,
    max_albedo: Float[Array, ""],
    *,
    directions: tuple[float, ...] = BOTH,
    keep: int = 4,
) -> RollMinima:
    """The `keep` best minima over the roll, in the given directions of x, by scans that grow finer around each.

    `earth` is the pattern of the albedo, `max_albedo` its largest factor over that of the direct light (`albedomax`).
    """
    signs = jnp.array(directions, dtype=measured.dtype)
    step = 2.0 * np.pi / COARSE_ROLLS
    x_body = jnp.array([1.0, 0.0, 0.0], dtype=measured.dtype)

    def over_roll(sign):
        base = field_aligned(b_field_eci, jnp.zeros_like(sign), sign)
        return panel_sinusoids(base, x_body, panels, earth, light)

    turns = [over_roll(sign) for sign in signs]
    coarse = step * jnp.arange(COARSE_ROLLS, dtype=measured.dtype)
    cosines, sines = jnp.cos(coarse), jnp.sin(coarse)
    found = jnp.stack([turn.squares(cosines, sines, measured, max_albedo) for turn in turns])
    # Without the barrier XLA computes all of it anew for each shift.
    found = jax.lax.optimization_barrier(found)
    lowest = (found <= jnp.roll(found, 1, axis=1)) & (found <= jnp.roll(found, -1, axis=1))
    candidates = jnp.where(lowest, found, jnp.inf).ravel()
    best = _smallest(candidates, keep)
    real = jnp.isfinite(candidates[best])
    ways = best // COARSE_ROLLS

    def refined(roll, way):
        turn = jax.tree.map(lambda *of: jnp.where(way == 0, of[0], of[-1]), *turns)

        c, s = jnp.cos(roll), jnp.sin(roll)
        for level in range(LEVELS):
            offsets = step * (2.0 / (POINTS - 1)) ** level * np.linspace(-1.0, 1.0, POINTS)
            # Sines and cosines of the offsets are constants: those of each roll would take most of the time.
            co, so = jnp.asarray(np.cos(offsets), roll.dtype), jnp.asarray(np.sin(offsets), roll.dtype)
            nearby_c, nearby_s = c * co - s * so, s * co + c * so
            best = jnp.argmin(turn.squares(nearby_c, nearby_s, measured, max_albedo))
            c, s = nearby_c[best], nearby_s[best]
        roll = jnp.arctan2(s, c)

        def residual(roll):
            direct, albedo = turn.patterns(roll)
            a, b = bounded_factors(direct, albedo, measured, max_albedo)
            return a * direct + b * albedo - measured, (a, b)

        left, slope, (direct, albedo) = jax.jvp(residual, (roll,), (jnp.ones_like(roll),), has_aux=True)
        attitude = field_aligned(b_field_eci, roll, signs[way])
        return LocalFit(attitude, jnp.sqrt(jnp.mean(left**2)), direct, albedo), slope @ slope

    fit, information = jax.vmap(refined)(coarse[best % COARSE_ROLLS], ways)
    rms = jnp.where(real, fit.rms, jnp.inf)
    order = jnp.argsort(rms)
    fit = eqx.tree_at(lambda f: f.rms, fit, rms)
    return jax.tree.map(lambda leaf: leaf[order], RollMinima(fit, signs[ways], information))


def _smallest(values, count):
    """Places of the smallest values; XLA's own top_k takes longer than all the rest of the search."""
    places, numbers = [], jnp.arange(values.size)
    for _ in range(count):
        places.append(jnp.argmin(values))
        values = jnp.where(numbers == places[-1], jnp.inf, values)
    return jnp.stack(places)
