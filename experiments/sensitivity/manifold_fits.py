"""Fits of one simulated session of Munin to growing parts of it, from the truth, and what each of them was worth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.assembly import Samples, build_problem
from fitting.measurements.problem import Problem
from fitting.outcome.looking import look
from fitting.outcome.uncertainty import at_bound, covariance
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.sensitivity.directions import SECOND_ORDER
from fitting.sensitivity.plan import around_at, planned_weight
from fitting.sensitivity.told import leverages, told
from fitting.solvers.least_squares import Point, prior_information
from fitting.solvers.refine import CONVERGED_DECREMENT, PLAIN
from fitting.starts.multi_start import Stage, solve
from jaxsat.satellites import Satellite
from jaxsat.telemetry.table.session import Channel
from jaxsat.time import Epoch

DIRECTIONS = 3
"""Weakest directions along which the linear picture is tried."""
ITERATIONS = 40
EVERY_S = 64.0
STEP_S = 12.8
"""Integration step; that of truth and fit is the same."""
SHORT_S, SHORT_ROOM_S = 2000.0, 2.0
NAMED = ("imax", "rods.y", "magnet.y")
"""Numbers of which errors are kept one by one."""


@dataclass(frozen=True)
class Row:
    """Parts of one set of instants, each fitted by itself, and what follows each."""

    name: str
    problem: Problem
    weight: np.ndarray
    """[samples channels] of all readings."""
    fitted: dict[int, np.ndarray]
    """{number of samples: which} of those that are fitted."""
    later: dict[int, np.ndarray]
    """The same of those that are predicted."""


@dataclass(frozen=True)
class Truth:
    """What a session is made of."""

    x: np.ndarray
    """Unknowns of the fit."""
    quaternion: np.ndarray
    noise: np.ndarray
    """[samples channels] in sigmas."""


def row_of(satellite: Satellite, name: str, t: np.ndarray, parts: dict[int, np.ndarray], held: int) -> Row:
    """A problem of instants `t` [s], parts of which are fitted; the next `held` after each are predicted."""
    settings = satellite.channels["cells"]
    channel = Channel.of("cells", settings, t, np.ones((len(t), len(settings.columns))))
    elements = satellite.orbit.elements
    if elements is None:
        raise ValueError("the satellite file must give its orbit as elements")
    epoch = Epoch.from_iso(elements.epoch)
    samples = Samples.of({"cells": channel}, epoch, {}, None)
    around = around_at(satellite, epoch, float(t[-1]))
    # Room as for the most steps of all rows, so that one program serves them.
    room = STEP_S if t[-1] > SHORT_S else SHORT_ROOM_S
    problem = build_problem(samples, satellite.model, around, delayed=("cells",), max_step=STEP_S, room_for=room)
    padded, later = {}, {}
    for count, index in parts.items():
        padded[count] = np.isin(np.arange(len(problem.valid)), index)
        later[count] = np.isin(np.arange(len(problem.valid)), followers(t, index, held))
    return Row(name, problem, planned_weight(problem, samples), padded, later)


def followers(t: np.ndarray, index: np.ndarray, held: int) -> np.ndarray:
    """The next `held` instants, `EVERY_S` apart, after those of `index`."""
    wanted = t[index[-1]] + EVERY_S * np.arange(1, held + 1)
    return np.flatnonzero(np.min(np.abs(t[:, None] - wanted), axis=1) < 1e-6)


def parameters_of(satellite: Satellite, free: Sequence[str]) -> FreeParameters:
    """The fit's unknowns."""
    names = chosen_leaves(satellite.leaves, free, satellite.aliases)
    return free_parameters(satellite.model, satellite.leaves, names, held=satellite.held)


def numbers_of_priors(parameters: FreeParameters, rng: np.random.Generator) -> np.ndarray:
    """[unknowns] after the state, each drawn from its prior within its bounds."""
    lower, upper = (each[len(STATE) :] for each in parameters.bounds())
    drawn = rng.normal(size=len(lower))
    for _ in range(100):
        out = (drawn < lower) | (drawn > upper)
        drawn[out] = rng.normal(size=int(out.sum()))
    return np.where(parameters.columns >= 0, np.clip(drawn, lower, upper), 0.0)


def measured(row: Row, parameters: FreeParameters, truth: Truth) -> tuple[Problem, tuple]:
    """The problem with the readings of the truth and their noise, and the look at the truth, without noise."""
    blank = {"cells": np.zeros_like(np.asarray(row.problem.measured["cells"]))}
    problem, last = replace(row.problem, measured=blank), int(np.flatnonzero(row.problem.valid)[-1])
    seen = looked(problem, parameters, truth.x, truth.quaternion, last)
    clean = seen[0] * np.asarray(problem.sigma)
    noisy = clean + truth.noise * np.asarray(problem.sigma)
    return replace(problem, measured={"cells": noisy}), (np.zeros_like(clean), *seen[1:])


def looked(problem: Problem, parameters: FreeParameters, x: np.ndarray, q: np.ndarray, last: int) -> tuple:
    """Residuals, their Jacobian, attitude, rate and the attitude's Jacobian at a point up to sample `last`."""
    found = look(problem, parameters.tree, x, q, problem.grid.blocks_to(last))
    return tuple(np.array(each) for each in found[:5])


def fits(row: Row, parameters: FreeParameters, truth: Truth) -> tuple[dict[int, dict], Any]:
    """{samples: what a fit of so many was worth}; and problem and points for those who ask more of them."""
    problem, at_truth = measured(row, parameters, truth)
    ends = {count: int(np.flatnonzero(row.later[count])[-1]) for count in row.fitted}
    counts = sorted(row.fitted, key=lambda count: ends[count])
    rows, points = {}, {}
    for group in [counts[k : k + 4] for k in range(0, len(counts), 4)]:
        x, q = (np.repeat(each[None], len(group), 0) for each in (truth.x, truth.quaternion))
        weight = np.array([row.weight * row.fitted[count][:, None] for count in group])
        last = max(ends[count] for count in group)
        found = solve(problem, parameters, Stage(last, 1, ITERATIONS, PLAIN, parameters.everything), x, q, weight)
        if np.any(found.decrement > CONVERGED_DECREMENT):
            stage = Stage(last, 1, ITERATIONS // 2, PLAIN, parameters.everything)
            found = solve(problem, parameters, stage, np.asarray(found.x), np.asarray(found.reference), weight)
        for k, count in enumerate(group):
            points[count] = one(found, k)
    for count, point in points.items():
        seen = looked(problem, parameters, point.x, point.reference, ends[count])
        rows[count] = worth(row, parameters, point, truth, at_truth, count, seen)
        rows[count]["holds_to"] = holds_to(row, problem, parameters, point, count, seen)
    return rows, (problem, points)


def one(points: Point, k: int) -> Point:
    """Number k of some points."""
    return jax.tree.map(lambda leaf: np.asarray(leaf)[k], points)


def worth(row, parameters, point, truth, at_truth, count, seen) -> dict[str, Any]:
    """What a user can compute of a fit, and how far it is off."""
    weight = row.weight * row.fitted[count][:, None]
    later = (row.weight > 0.0) & row.later[count][:, None]
    residual, jacobian, q, _, turns = seen
    cov, free = covariance_at(parameters, point)
    gauges = len(parameters.gauged)
    found = told(jacobian[..., free], weight, cov, later, unknowns=int(free.sum()) - gauges)
    fitted = row.fitted[count]
    spread = np.einsum("sku,uv,skv->s", turns[fitted][..., free], cov, turns[fitted][..., free], optimize=True)
    true = Rotation.from_quat(at_truth[2][fitted], scalar_first=True)
    off = (true.inv() * Rotation.from_quat(q[fitted], scalar_first=True)).magnitude()
    tells = leverages(jacobian[..., free], weight, cov) > 1e-6
    # The mean of what is measured later, less the noise of it: the fit's own error.
    clean = (residual + truth.noise)[later & (np.abs(jacobian).max(axis=-1) > 0.0)]
    sigma = np.sqrt(np.diagonal(cov))
    own = np.flatnonzero(free) >= len(STATE)
    error = (point.x - truth.x)[free][own]
    data = (weight[..., None] * jacobian[..., free]).reshape(-1, free.sum())
    scaled = data.T @ jacobian[..., free].reshape(-1, free.sum())
    root = np.sqrt(np.maximum(np.diagonal(scaled), 1e-300))
    values = np.linalg.eigvalsh(scaled / np.outer(root, root))
    return {
        "unknowns": found.unknowns,
        "told": found.by_data,
        "readings": found.readings,
        "ahead": found.ahead,
        "condition": float(np.sqrt(values[-1] / max(values[gauges], 1e-16))),
        "square": float((residual[tells] ** 2).sum()),
        "attitude_sigma_deg": float(np.degrees(np.sqrt(spread.mean()))),
        "attitude_deg": float(np.degrees(np.sqrt((off**2).mean()))),
        "missed": float(np.sqrt((clean**2).mean())) if clean.size else 0.0,
        "later": int(clean.size),
        "numbers_off": float(np.sqrt(np.mean((error / sigma[own]) ** 2))) if own.any() else 0.0,
        # Along what is held by definition this is what the prior drew, where the prior pulls.
        "walked": float(np.sqrt(np.mean(error**2))) if own.any() else 0.0,
        "named": {
            name: float((point.x - truth.x)[k] / np.sqrt(cov[m, m]))
            for m, k in enumerate(np.flatnonzero(free))
            if (name := parameters.names[k]) in NAMED
        },
        "bounded": near_bound(parameters, point, free, sigma),
        "settled": bool(point.decrement <= CONVERGED_DECREMENT),
    }


def near_bound(parameters: FreeParameters, point: Point, free: np.ndarray, sigma: np.ndarray) -> int:
    """Numbers with a bound that is nearer than one sigma, those that press on it among them."""
    lower, upper = parameters.bounds()
    near = np.minimum(point.x - lower, upper - point.x)[free] < sigma
    return int(near.sum() + (parameters.everything & ~free).sum())


def covariance_at(parameters: FreeParameters, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of the unknowns that moved, and which they are [unknowns bool]."""
    free = parameters.everything & ~at_bound(np.asarray(point.x), np.asarray(point.gradient), parameters.bounds())
    cov = covariance(np.asarray(point.hessian), free, prior_information(len(free)))
    return cov[np.ix_(free, free)], free


def holds_to(row, problem, parameters, point, count, seen) -> float:
    """Sigmas to which the linear picture of a fit holds, as `fitting.sensitivity.directions.linearity` has it.

    What is held by definition is left out, and steps end at bounds, which bend nothing.
    """
    weight = row.weight * row.fitted[count][:, None]
    residual, jacobian = seen[:2]
    free = covariance_at(parameters, point)[1]
    steps = np.zeros((DIRECTIONS, len(free)))
    steps[:, free] = weakest(np.asarray(point.hessian)[np.ix_(free, free)], free, len(parameters.gauged))
    both = np.clip(point.x + np.concatenate([steps, -steps]), *parameters.bounds()) - point.x
    # Evaluated and not moved.
    stage = Stage(int(np.flatnonzero(weight.any(axis=1))[-1]), 1, 0, PLAIN, parameters.everything)
    many = np.repeat(point.reference[None], len(both), 0)
    moved = solve(problem, parameters, stage, point.x + both, many, weight)
    bent = np.asarray(moved.prediction.residual) - residual - np.einsum("scu,ku->ksc", jacobian, both)
    size = np.sqrt((weight * np.where(weight > 0.0, bent, 0.0) ** 2).sum(axis=(1, 2)))
    return float(SECOND_ORDER / max(np.nan_to_num(size, nan=np.inf).max(), 1e-12))


def weakest(matrix: np.ndarray, free: np.ndarray, gauges: int) -> np.ndarray:
    """[directions unknowns] steps of one sigma along what is known worst, across what is held by definition."""
    prior = prior_information(len(free))[free]
    root = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    across = np.eye(len(matrix))
    if gauges:
        # Of the data alone these have no information; their part of the state is none.
        data = (matrix - np.diag(prior)) / np.outer(root, root)
        held = np.linalg.eigh(data)[1][:, :gauges] / root[:, None] * prior[:, None]
        across = np.linalg.svd(held.T)[2][gauges:].T
    inner = across.T @ matrix @ across
    own = np.sqrt(np.maximum(np.diagonal(inner), 1e-300))
    values, vectors = np.linalg.eigh(inner / np.outer(own, own))
    return (across / own @ vectors[:, :DIRECTIONS] / np.sqrt(np.maximum(values[:DIRECTIONS], 1e-300))).T
