"""Adaptive weights of the program `als`: six rules and two corrections of the data, renewed at each pass.

Penkov et al. 2009, section 2.1, whose model has no albedo: the weights are there to keep its light out. The paper
names the rules and the formula of the sixth; the forms of the others, and all numbers, are ours.
"""

from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.measurements.groups import columns_of
from fitting.measurements.problem import Problem
from fitting.parameters.free import FreeParameters
from fitting.parameters.names import STATE
from fitting.parameters.tree import FreeLeaves
from fitting.solvers.least_squares import Point
from fitting.solvers.refine import PLAIN, Refined, candidates
from fitting.solvers.rules import AdaptiveRules
from fitting.starts.multi_start import Progress, Stage, Starts, distinct, solve
from fitting.stored import Stored
from jaxsat.errors import InputError
from jaxsat.math import quaternion
from jaxsat.satellites.model import Model, with_values
from jaxsat.sensors import Albedo, Panels
from jaxsat.sensors.solar_panels import earthlight


@dataclass(frozen=True)
class PanelLight:
    """What the panels saw in the last solution; all [samples panels]."""

    direct: np.ndarray
    """Current of the Sun's own light [A]."""
    specular: np.ndarray
    """Current of the mirror image at reflectivity one [A]."""
    cos_sun: np.ndarray
    """Of the angle from the normal to the Sun."""
    cos_zenith: np.ndarray
    """Of the angle from the normal to the radius vector."""


def panels_of(model: Model) -> str:
    """Name of the channel of panels; raises `InputError` where there is none, or several."""
    found = [name for name, sensor in model.sensors.items() if isinstance(sensor, Panels)]
    if len(found) != 1:
        several = f"and this one has {', '.join(found)}" if found else "and this one has none"
        raise InputError(
            f"adaptive weights are those of the currents of one sensor of panels, {several}", field="adaptive.on"
        )
    return found[0]


def _panel_light(
    problem: Problem,
    name: str,
    parameters: FreeLeaves,
    x: Float[Array, " unknowns"],
    q: Float[Array, "samples 4"],
) -> tuple[Array, ...]:
    model = with_values(problem.model, parameters.spots, parameters.values(x[len(STATE) :]))
    panels, sky = model.sensors[name], jax.tree.map(jnp.asarray, problem.sky)
    assert isinstance(panels, Panels) and sky.light is not None
    mirror = Albedo(jnp.ones(()), jnp.zeros(()))
    distance = jnp.sqrt(jnp.sum(sky.position_eci**2, axis=1))
    normals, full = panels.tilted_normals(), panels.max_current * panels.gain

    def at_sample(q, light, up):
        normals_eci = normals @ quaternion.to_dcm(q).T
        cos_sun = normals_eci @ light.sun_eci
        return (
            full * light.illumination * jnp.maximum(cos_sun, 0.0),
            full * earthlight(normals_eci, mirror, light),
            cos_sun,
            normals_eci @ up,
        )

    arrays = jax.vmap(at_sample)(q, sky.light, sky.position_eci / distance[:, None])
    return (*arrays, distance, panels.max_current)


panel_light = Stored(_panel_light)
"""Arrays of `PanelLight` in order, the distance from the Earth's centre [m] at each sample, the largest current [A]."""


def rule_weights(
    rules: AdaptiveRules,
    measured: np.ndarray,
    light: PanelLight,
    cos_horizon: np.ndarray,
    normals: np.ndarray,
    max_current: float,
    number: int,
) -> np.ndarray:
    """[samples panels] weights of the currents `measured` [samples panels, A] at pass `number` from 1, of mean one.

    `normals` [panels 3] are those of the panels; `cos_horizon` [samples] is cos Theta of the paper's figure 1,
    sqrt(1 - (R/r)^2): a panel whose normal is nearer to the radius vector than that sees nothing of the Earth.
    """
    possible = np.maximum(light.direct.sum(axis=1), 1e-3 * max_current)
    share = measured.sum(axis=1) / possible
    weight = np.ones_like(measured)
    if rules.limiting_ratio > 0.0:
        weight *= np.minimum(share / rules.limiting_ratio, 1.0)[:, None] ** rules.limiting_power
    weight *= 1.0 + rules.large_gain * (measured / max_current) ** 2
    weight *= np.where(measured < 1e-3 * rules.small_mA, rules.small_factor, 1.0)
    weight *= np.where(light.cos_zenith >= cos_horizon[:, None], rules.away_factor, 1.0)
    # Of a panel between the axes by its shares of each.
    weight *= np.square(normals) @ np.asarray(rules.axis_factors)
    ratio = rules.specular_reflectivity * light.specular / (light.direct + 1e-3 * rules.specular_delta_mA)
    weight /= (1.0 + rules.specular_alpha * ratio) ** number
    return weight / weight.mean()


def corrected(rules: AdaptiveRules, measured: np.ndarray, sunlit: np.ndarray, light: PanelLight | None) -> np.ndarray:
    """[samples panels] the currents, zero where direct light cannot have made them; `sunlit` [samples]."""
    found = np.array(measured)
    if rules.zero_in_shadow:
        found[~sunlit] = 0.0
    if rules.zero_turned_away and light is not None:
        found[light.cos_sun <= 0.0] = 0.0
    return found


@dataclass(frozen=True)
class _Currents:
    """The currents that the rules are about."""

    name: str
    columns: slice
    measured: np.ndarray
    """[samples panels], zero where not measured [A]."""
    known: np.ndarray
    sunlit: np.ndarray
    """[samples]"""
    normals: np.ndarray
    sigma: float
    """Of a current [A]."""

    @staticmethod
    def of(problem: Problem) -> "_Currents":
        name = panels_of(problem.model)
        sensor, light, columns = problem.model.sensors[name], problem.sky.light, columns_of(problem.groups)
        own = next(each for group, each in zip(problem.groups, columns, strict=True) if group.name == name)
        assert isinstance(sensor, Panels) and light is not None
        return _Currents(
            name=name,
            columns=own,
            measured=np.asarray(problem.measured[name]),
            known=np.asarray(problem.known)[:, own],
            sunlit=np.asarray(light.illumination) > 0.5,
            normals=np.asarray(sensor.normals),
            sigma=float(np.asarray(problem.sigma)[own][0]),
        )


def refine_adaptively(
    problem: Problem,
    parameters: FreeParameters,
    survivors: Starts,
    weight: np.ndarray,
    rules: AdaptiveRules,
    earth_radius: float,
    progress: Progress,
) -> Refined:
    """`refine` by the rules: `weight` [samples channels] is renewed at each of the passes, for each of the survivors.

    The rules are about the currents of one sensor of panels; other channels keep their weight. Residuals of the result
    are those of the measured currents, its cost and information matrix those of the last pass. Raises `InputError` as
    `panels_of` does.
    """
    currents = _Currents.of(problem)
    chosen = survivors.take(candidates(survivors.cost))
    found, total = [], rules.passes * len(chosen.cost)
    for start in range(len(chosen.cost)):
        x, reference = chosen.x[start : start + 1], chosen.reference[start : start + 1]
        place = (start * rules.passes, total)
        found.append(_passes(problem, parameters, currents, x, reference, weight, rules, earth_radius, progress, place))
    points = jax.tree.map(lambda *leaves: np.concatenate(leaves), *found)
    order = distinct(Starts(points.x, points.reference, points.cost), attitude=0.02, rate=2e-3)
    points = jax.tree.map(lambda leaf: leaf[order], points)
    nothing = np.zeros((*points.weight.shape[:2], len(problem.groups)), bool)
    return Refined(points, points.cost, nothing, np.zeros(len(order), bool))


def _passes(problem, parameters, currents, x, reference, weight, rules, earth_radius, progress, place) -> Point:
    last, everything = int(np.flatnonzero(problem.valid)[-1]), parameters.everything
    light, each, data = None, weight, corrected(rules, currents.measured, currents.sunlit, None)
    for number in range(1, rules.passes + 1):
        progress("refining", place[0] + number - 1, place[1])
        of_pass = replace(problem, measured={**problem.measured, currents.name: data})
        points = solve(of_pass, parameters, Stage(last, 1, 12, PLAIN, everything), x, reference, each[None])
        x, reference = np.asarray(points.x), np.asarray(points.reference)
        if number < rules.passes:
            found = panel_light(problem, currents.name, parameters.tree, x[0], points.prediction.quaternion[0])
            *arrays, distance, most = (np.asarray(array) for array in found)
            light = PanelLight(*arrays)
            cos_horizon = np.sqrt(1.0 - (earth_radius / distance) ** 2)
            each = weight.copy()
            each[:, currents.columns] *= rule_weights(
                rules, currents.measured, light, cos_horizon, currents.normals, float(most), number
            )
            data = corrected(rules, currents.measured, currents.sunlit, light)
    residual = np.array(points.prediction.residual)
    residual[..., currents.columns] += np.where(currents.known, (data - currents.measured) / currents.sigma, 0.0)
    return eqx.tree_at(lambda p: p.prediction.residual, points, residual)
