"""Adaptive weights of the program `als`: six rules and two corrections of the data, renewed at each pass.

Penkov et al. 2009, section 2.1, whose model has no albedo: the weights are there to keep its light out. The paper
names the rules and the formula of the sixth; the forms of the others, and all numbers, are ours.
"""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.measurements.problem import CURRENTS, Problem
from fitting.parameters.names import MODEL, STATE
from fitting.parameters.parametrization import Parametrization, build_model
from fitting.settings import AdaptiveRules
from fitting.solvers.least_squares import Point
from fitting.solvers.refine import PLAIN, Refined, candidates
from fitting.starts.multi_start import Progress, Stage, Starts, distinct, solve
from fitting.stored import Stored
from jaxsat.math import quaternion
from jaxsat.sensors.solar_panels import Albedo, albedo_currents, direct_currents


@dataclass(frozen=True)
class PanelLight:
    """What the panels saw in the last solution; all [samples 6]."""

    direct: np.ndarray
    """Current of the Sun's own light [A]."""
    specular: np.ndarray
    """Current of the mirror image at reflectivity one [A]."""
    cos_sun: np.ndarray
    """Of the angle from the normal to the Sun."""
    cos_zenith: np.ndarray
    """Of the angle from the normal to the radius vector."""


def _panel_light(
    problem: Problem, parameters: Parametrization, x: Float[Array, " unknowns"], q: Float[Array, "samples 4"]
) -> tuple[Array, ...]:
    values = parameters.values(x[len(STATE) :])
    _, panels, _ = build_model(values, jnp.asarray(parameters.reference_field))
    mirror = Albedo(jnp.ones(()), jnp.zeros(()))
    at_samples = jnp.asarray(problem.grid.sample_node)
    radius_vector = problem.orbit.position_eci[at_samples]
    distance = jnp.sqrt(jnp.sum(radius_vector**2, axis=1))

    def at_sample(q, light, up):
        return (
            direct_currents(q, panels, light),
            albedo_currents(q, panels, mirror, light),
            panels.normals @ quaternion.rotate_inverse(q, light.sun_eci),
            panels.normals @ quaternion.rotate_inverse(q, up),
        )

    return (*jax.vmap(at_sample)(q, problem.light, radius_vector / distance[:, None]), distance)


panel_light = Stored(_panel_light)
"""Arrays of `PanelLight` in order, and the distance from the Earth's centre [m] at each sample."""


def rule_weights(
    rules: AdaptiveRules,
    measured: np.ndarray,
    light: PanelLight,
    cos_horizon: np.ndarray,
    max_current: float,
    number: int,
) -> np.ndarray:
    """[samples 6] weights of the currents `measured` [samples 6, A] at pass `number` from 1, of mean one.

    `cos_horizon` [samples] is cos Theta of the paper's figure 1, sqrt(1 - (R/r)^2): a panel whose normal is nearer to
    the radius vector than that sees nothing of the Earth.
    """
    possible = np.maximum(light.direct.sum(axis=1), 1e-3 * max_current)
    share = measured.sum(axis=1) / possible
    weight = np.ones_like(measured)
    if rules.limiting_ratio > 0.0:
        weight *= np.minimum(share / rules.limiting_ratio, 1.0)[:, None] ** rules.limiting_power
    weight *= 1.0 + rules.large_gain * (measured / max_current) ** 2
    weight *= np.where(measured < 1e-3 * rules.small_mA, rules.small_factor, 1.0)
    weight *= np.where(light.cos_zenith >= cos_horizon[:, None], rules.away_factor, 1.0)
    weight *= np.repeat(rules.axis_factors, 2)
    ratio = rules.specular_reflectivity * light.specular / (light.direct + 1e-3 * rules.specular_delta_mA)
    weight /= (1.0 + rules.specular_alpha * ratio) ** number
    return weight / weight.mean()


def corrected(rules: AdaptiveRules, measured: np.ndarray, sunlit: np.ndarray, light: PanelLight | None) -> np.ndarray:
    """[samples 6] the currents with those that direct light cannot have made taken for zero; `sunlit` [samples]."""
    found = np.array(measured)
    if rules.zero_in_shadow:
        found[~sunlit] = 0.0
    if rules.zero_turned_away and light is not None:
        found[light.cos_sun <= 0.0] = 0.0
    return found


def refine_adaptively(
    problem: Problem,
    parameters: Parametrization,
    survivors: Starts,
    weight: np.ndarray,
    rules: AdaptiveRules,
    earth_radius: float,
    progress: Progress,
) -> Refined:
    """`refine` by the rules: `weight` [samples channels] is renewed at each of the passes, for each of the survivors.

    The rules are about currents; limb angles keep their weight.

    Residuals of the result are those of the measured currents, its cost and information matrix those of the last pass.
    """
    chosen = survivors.take(candidates(survivors.cost))
    found, total = [], rules.passes * len(chosen.cost)
    for start in range(len(chosen.cost)):
        x, reference = chosen.x[start : start + 1], chosen.reference[start : start + 1]
        found.append(
            _passes(
                problem, parameters, x, reference, weight, rules, earth_radius, progress, (start * rules.passes, total)
            )
        )
    points = jax.tree.map(lambda *leaves: np.concatenate(leaves), *found)
    order = distinct(Starts(points.x, points.reference, points.cost), attitude=0.02, rate=2e-3)
    points = jax.tree.map(lambda leaf: leaf[order], points)
    nothing = np.zeros((*points.weight.shape[:2], len(problem.groups)), bool)
    return Refined(points, points.cost, nothing, np.zeros(len(order), bool))


def _passes(problem, parameters, x, reference, weight, rules, earth_radius, progress, place) -> Point:
    last, everything = int(np.flatnonzero(problem.valid)[-1]), parameters.everything
    measured, sunlit = np.asarray(problem.measured), problem.sunlit()
    light, each, data = None, weight, corrected(rules, measured, sunlit, None)
    for number in range(1, rules.passes + 1):
        progress("refining", place[0] + number - 1, place[1])
        of_pass = eqx.tree_at(lambda p: p.measured, problem, data)
        points = solve(of_pass, parameters, Stage(last, 1, 12, PLAIN, everything), x, reference, each[None])
        x, reference = np.asarray(points.x), np.asarray(points.reference)
        if number < rules.passes:
            *arrays, distance = panel_light(problem, parameters, x[0], points.prediction.quaternion[0])
            light = PanelLight(*(np.asarray(array) for array in arrays))
            cos_horizon = np.sqrt(1.0 - (earth_radius / np.asarray(distance)) ** 2)
            max_current = float(np.asarray(parameters.values(x[0, len(STATE) :]))[MODEL.index("imax")])
            each = weight.copy()
            each[:, : CURRENTS.width] *= rule_weights(rules, measured, light, cos_horizon, max_current, number)
            data = corrected(rules, measured, sunlit, light)
    residual = np.array(points.prediction.residual)
    residual[..., : CURRENTS.width] += (data - measured) / float(problem.noise)
    return eqx.tree_at(lambda p: p.prediction.residual, points, residual)
