"""Local method of `OrbfiGraf` (Penkov et al. 2009, sec. 3.2): attitude of single samples with a magnet along the field.

The magnet's axis, body x there, is assumed to lie along the magnetic field, in one of the two directions. For each roll
about it the currents are explained by a direct and an albedo part, the albedo bounded; the roll that explains them best
wins.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.local.shares import LocalFit, bounded_factors, patterns
from fitting.local.turn import attitude_after, initial_attitude, panel_sinusoids
from jaxsat.environment import LightTable
from jaxsat.math import quaternion, unit
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.spacecraft import SolarPanels

COARSE_ROLLS = 72
"""Rolls of the first turn: steps of 5 deg are well below the 90 deg between two panels."""
LEVELS, POINTS = 6, 9
"""Each finer scan covers one step of the last to both sides with `POINTS` rolls: 6 of them end at 0.001 deg."""
BOTH = (1.0, -1.0)
"""The magnet's axis along the field and against it."""


class RollMinima(eqx.Module):
    """Rolls that explain one sample, the best first; where there are fewer, the rest have an infinite rms."""

    fit: LocalFit
    along: Float[Array, "*found"]
    """+1 with the axis along the field, -1 against it."""
    slopes: Float[Array, "*found 6 3"]
    """Derivative of the residuals by a small rotation about the body axes, the factors following [A/rad]."""


def roll_minima(
    measured: Float[Array, "6"],
    b_field_eci: Float[Array, "3"],
    panels: SolarPanels,
    earth: Albedo,
    light: LightTable,
    max_albedo: Float[Array, ""],
    axis_body: Float[Array, "3"],
    *,
    directions: tuple[float, ...] = BOTH,
    keep: int = 4,
) -> RollMinima:
    """The `keep` best minima over the roll, in the given directions of the axis, by scans that grow finer around each.

    `axis_body` need not be a unit vector. `earth` is the pattern of the albedo, `max_albedo` its largest factor over
    that of the direct light (`albedomax`).
    """
    signs = jnp.array(directions, dtype=measured.dtype)
    step = 2.0 * np.pi / COARSE_ROLLS
    axis, along = unit(axis_body), unit(b_field_eci)

    def over_roll(sign):
        return panel_sinusoids(initial_attitude(sign * along, axis), axis, panels, earth, light)

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

        toward = signs[way] * along
        attitude = attitude_after(initial_attitude(toward, axis), toward, roll)

        def residual(small):
            turned = quaternion.multiply(attitude, quaternion.from_rotation_vector(small))
            direct, albedo = patterns(turned, panels, earth, light)
            a, b = bounded_factors(direct, albedo, measured, max_albedo)
            return a * direct + b * albedo - measured, (a, b)

        (left, (direct, albedo)), slopes = _with_slopes(residual, jnp.zeros(3, roll.dtype))
        return LocalFit(attitude, jnp.sqrt(jnp.mean(left**2)), direct, albedo), slopes

    fit, slopes = jax.vmap(refined)(coarse[best % COARSE_ROLLS], ways)
    rms = jnp.where(real, fit.rms, jnp.inf)
    order = jnp.argsort(rms)
    fit = eqx.tree_at(lambda f: f.rms, fit, rms)
    return jax.tree.map(lambda leaf: leaf[order], RollMinima(fit, signs[ways], slopes))


def _with_slopes(function, at):
    """Its value, with what comes beside it, and its derivative [value 3]."""

    def column(way):
        value, slope, beside = jax.jvp(function, (at,), (way,), has_aux=True)
        return (value, beside), slope

    return jax.vmap(column, out_axes=(None, 1))(jnp.eye(3, dtype=at.dtype))


def _smallest(values, count):
    """Places of the smallest values; XLA's own top_k takes longer than all the rest of the search."""
    places, numbers = [], jnp.arange(values.size)
    for _ in range(count):
        places.append(jnp.argmin(values))
        values = jnp.where(numbers == places[-1], jnp.inf, values)
    return jnp.stack(places)
