"""The last steps of a fit: whole arc, fine grid, samples that no attitude explains left out, minima compared."""

from dataclasses import dataclass, replace

import jax
import numpy as np

from fitting.measurements.abstract import AbstractProblem
from fitting.measurements.groups import Groups, of_groups, over_columns
from fitting.outcome.uncertainty import at_bound, covariance, promised_saving, undamped_step
from fitting.parameters.free import FreeParameters
from fitting.solvers.least_squares import Point
from fitting.starts.multi_start import NONE, Progress, Stage, Starts, advance, distinct, solve

MAX_LEFT_OUT = 0.35
"""Largest share of bright samples that may be left out; beyond it the model is wrong, not the samples."""
MOST_BACK = 0.02
"""Share of bright samples that may be left out though the minimum explains them; more are taken back."""
TAKEN_BACK = 3
"""Times at most: a motion on its way along a narrow bent valley explains more of them each time."""
ROBUST_SCALE, PLAIN = 3.0, 1e4
TAIL = 6.0
"""Degrees of freedom of Student's distribution, as many as a sample has currents."""
CONVERGED_DECREMENT = 1e-2
"""An undamped step would improve the cost by less than this: a tenth of a sigma in every direction."""
MORE_ROUNDS, MORE_STEPS = 6, 60
"""Rounds more, with fresh damping, while a minimum is not reached so far; the last ones, if it explains the data, of so
many steps, which a narrow bent valley takes, as of a nearly chaotic motion."""
SHARES, MORE_TRIES = (1.0, 0.3, 0.1), 20
"""Of a step that are tried where it is doubted, and how often more."""
LEAST_KEPT = 0.05
"""Share of what a step promises that a round brings at least, or the rounds end."""
MAX_MINIMA = 8
"""Minima compared on the whole arc."""


@dataclass(frozen=True)
class Share:
    """How one round after the first treats samples that no attitude explains."""

    leave_out: bool = False
    """By the squares of the round before."""
    tail: float = NONE
    ceiling: float = NONE
    """As in `solvers.least_squares.Settings`."""


LIKELIHOODS = {
    "normal": (Share(),),
    "student": (Share(tail=TAIL),),
    "mixture": (Share(ceiling=1.0), Share(leave_out=True)),
    "trimmed": (Share(leave_out=True),) * 3,
}
"""What a sample's residuals may be: normal; Student's; normal or, with a probability that is estimated for each sample,
anything, as under a limited charge current; normal or left out."""


@dataclass(frozen=True)
class Refined:
    """Minima over the whole arc, best first."""

    points: Point
    """Leaves with the minima in front, on the host."""
    score: np.ndarray
    """[minima] half the truncated sum of squares, comparable between minima that left out different samples."""
    limited: np.ndarray
    """[minima samples groups] left out as inexplicable."""
    hopeless: np.ndarray
    """[minima] True where more samples of a group than `MAX_LEFT_OUT` were inexplicable; then none was left out."""


def candidates(cost: np.ndarray) -> np.ndarray:
    """Indices of the minima that might still win, of costs in rising order: `MAX_MINIMA` of them at most.

    Nothing that is left out or freed later halves the cost of a wrong minimum alone.
    """
    return np.flatnonzero(cost <= 2.0 * cost[0] + 50.0)[:MAX_MINIMA]


def refine(
    problem: AbstractProblem,
    parameters: FreeParameters,
    survivors: Starts,
    weight: np.ndarray,
    *,
    likelihood: str,
    progress: Progress,
    solver: str = Stage.solver,
    patience: int = MORE_ROUNDS,
    hasty: bool = False,
) -> Refined:
    """Refines the best survivors on the problem's own grid, and ranks the minima by one truncated cost.

    There is none of a start whose motion the grid's steps cannot follow.

    `weight` [samples channels] is that of the measurements; `likelihood`, one of `LIKELIHOODS`, is that of the
    currents: a sample whose currents are left out keeps its limb angles; `solver` is one of `chunk.EVALUATIONS`;
    `patience` the rounds more, at most, for what is not at its minimum. Where `hasty`, there is one if none of the
    minima explains the data, and nothing else: the search goes on otherwise.
    """
    chosen = survivors.take(candidates(survivors.cost))
    count = len(chosen.cost)
    last = int(np.flatnonzero(problem.valid)[-1])
    everything = parameters.everything
    weight = np.broadcast_to(weight, (count, *weight.shape))
    shares = LIKELIHOODS[likelihood]
    rounds = len(shares) + 1

    def run(number: int, stage: Stage, x: np.ndarray, reference: np.ndarray, weight: np.ndarray) -> Point:
        progress("refining", number, rounds)
        return solve(problem, parameters, stage, x, reference, weight)

    def settle(points: Point, number: int, stage: Stage, weight: np.ndarray, rounds_more: int = patience) -> Point:
        # The other solvers, which are there to compare, take ten times as long.
        own, stuck = solver == Stage.solver, False
        for _ in range(rounds_more if own else 1):
            left, promised, _ = _unsettled(points, parameters)
            if len(left) == 0:
                break
            again = run(number, stage, np.asarray(points.x)[left], np.asarray(points.reference)[left], weight[left])
            stuck = bool(np.all(np.asarray(points.cost)[left] - again.cost < LEAST_KEPT * promised))
            points = jax.tree.map(lambda old, new, left=left: _replaced(old, left, new), points, again)
            if stuck:
                break
        # On a kink, where a panel's horizon passes a sample or a rod turns back, no damped step may be better than the
        # point though the undamped one is, or a share of it; or slopes promise what none brings.
        stage = replace(stage, iterations=0)
        for _ in range(MORE_TRIES if stuck and own else 0):
            left, promised, steps = _unsettled(points, parameters)
            if len(left) == 0:
                break
            starts = Starts(*(np.asarray(leaf)[left] for leaf in (points.x, points.reference, points.cost)))
            x, saved = tried(problem, parameters, stage, starts, steps, weight[left])
            if np.all(saved < LEAST_KEPT * promised):
                break
            again = run(number, stage, x, starts.reference, weight[left])
            points = jax.tree.map(lambda old, new, left=left: _replaced(old, left, new), points, again)
        return points

    groups = problem.groups
    limits = np.array([group.limit for group in groups])
    used = of_groups(weight, groups) > 0
    bright = used & problem.telling()
    trims = shares[-1].leave_out

    def inexplicable(points: Point) -> np.ndarray:
        return (_sample_squares(points, weight, groups) > limits) & used

    stage = Stage(last, count, 12, ROBUST_SCALE, everything, solver=solver)
    points = run(0, stage, chosen.x, chosen.reference, weight)
    lost = hasty and trims and _too_many(inexplicable(points), bright).all()
    # To the end: what is still on its way must not choose which samples are left out.
    points = settle(points, 0, stage, weight, 1 if lost else patience)
    hopeless = _too_many(inexplicable(points), bright) if trims else np.zeros(count, bool)
    limited, kept, lost = np.zeros(used.shape, bool), weight, hasty and hopeless.all()
    for number, share in enumerate(() if lost else shares, start=1):
        if share.leave_out:
            limited = inexplicable(points)
            hopeless = _too_many(limited, bright)
            limited &= ~hopeless[:, None, None]
        stage = Stage(last, count, 15, PLAIN, everything, share.tail, share.ceiling, solver=solver)
        kept = np.where(over_columns(limited, groups), 0.0, weight)
        points = run(number, stage, np.asarray(points.x), np.asarray(points.reference), kept)
    longer = replace(stage, iterations=MORE_STEPS) if solver == Stage.solver else stage
    if not lost:
        points = settle(points, rounds - 1, stage if hopeless.all() else longer, kept)
    for _ in range(TAKEN_BACK if trims and not lost else 0):
        # What more rounds have brought to explain the samples is not hopeless any more, and leaves out what is left.
        outlying = inexplicable(points)
        cured = hopeless & ~_too_many(outlying, bright)
        hopeless &= ~cured
        # And what was left out on the way, where the motion was not yet that of the data, may be explained by it.
        back = np.sum(limited & ~outlying, axis=1) > MOST_BACK * bright.sum(axis=1)
        changed = cured | (back.any(axis=1) & ~hopeless)
        if not changed.any():
            break
        limited[changed] = outlying[changed]
        kept = np.where(over_columns(limited, groups), 0.0, weight)
        points = run(rounds - 1, longer, np.asarray(points.x), np.asarray(points.reference), kept)
        points = settle(points, rounds - 1, longer, kept)
    of_samples = _sample_squares(points, weight, groups)
    x, reference = np.asarray(points.x), np.asarray(points.reference)
    score = 0.5 * np.minimum(of_samples, limits).sum(axis=(1, 2))
    score = score + 0.5 * (x[:, 6:] ** 2).sum(axis=1)
    # A motion that these steps cannot follow has been nowhere, and has no residuals.
    score = np.where(np.isfinite(points.cost), score, np.inf)
    order = distinct(Starts(x, reference, score), attitude=0.02, rate=2e-3)
    progress("refining", rounds, rounds)
    return Refined(jax.tree.map(lambda leaf: leaf[order], points), score[order], limited[order], hopeless[order])


def tried(
    problem: AbstractProblem,
    parameters: FreeParameters,
    stage: Stage,
    starts: Starts,
    steps: np.ndarray,
    weight: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Best points [starts unknowns] on the way of `steps` from starts, and the cost that is seen to be saved there.

    `weight` is [starts samples channels]; the stage, of which no step is taken, says the loss.
    """
    shares, count = np.array([0.0, *SHARES]), len(starts.x)
    x = np.clip(starts.x[:, None] + shares[:, None] * steps[:, None], *parameters.bounds())
    reference, weight = (np.repeat(leaf, len(shares), axis=0) for leaf in (starts.reference, weight))
    ways = Starts(x.reshape(-1, x.shape[-1]), reference, np.zeros(len(reference)))
    cost = advance(problem, parameters, stage, ways, weight).cost.reshape(count, -1)
    best = np.argmin(np.where(np.isfinite(cost), cost, np.inf), axis=1)
    each = np.arange(count)
    return x[each, best], cost[:, 0] - cost[each, best]


def tried_saving(problem: AbstractProblem, parameters: FreeParameters, point: Point, step: np.ndarray) -> float:
    """Cost that a step [unknowns] from a minimum, or a share of it, is seen to save.

    On a kink, where a face's horizon passes a sample, slopes promise what none brings.
    """
    x, reference, weight = (np.asarray(leaf)[None] for leaf in (point.x, point.reference, point.weight))
    stage = Stage(int(np.flatnonzero(problem.valid)[-1]), 1, 0, PLAIN, parameters.everything)
    starts = Starts(x, reference, np.zeros(1))
    return float(tried(problem, parameters, stage, starts, step[None], weight)[1][0])


def _unsettled(points: Point, parameters: FreeParameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Indices of minima that more steps would lower (the best, and those that might become it), by how much, steps."""
    costs = np.where(np.isfinite(points.cost), points.cost, np.inf)
    found, promises, steps = [], [], []
    for k in np.flatnonzero(np.isfinite(costs)):
        x, gradient, information = (np.asarray(leaf)[k] for leaf in (points.x, points.gradient, points.hessian))
        pressed = at_bound(x, gradient, parameters.bounds())
        cov = covariance(information, ~pressed)
        promise = promised_saving(gradient, cov, pressed)
        if promise > CONVERGED_DECREMENT and costs[k] - promise <= costs.min():
            found.append(k)
            promises.append(promise)
            steps.append(undamped_step(gradient, cov, pressed))
    return np.array(found, dtype=int), np.array(promises), np.array(steps)


def _replaced(old: np.ndarray, index: np.ndarray, new: np.ndarray) -> np.ndarray:
    """A copy of an array over the minima with those at `index` in place of the old ones."""
    result = np.array(old)
    result[index] = new
    return result


def _sample_squares(points: Point, weight: np.ndarray, groups: Groups) -> np.ndarray:
    """[minima samples groups] sums over the readings of a sample."""
    return of_groups(np.asarray(points.prediction.residual) ** 2 * weight, groups)


def _too_many(limited: np.ndarray, telling: np.ndarray) -> np.ndarray:
    """[minima] whether of some group more samples than `MAX_LEFT_OUT` of those that tell something are left out."""
    return np.any(limited.sum(axis=1) > MAX_LEFT_OUT * telling.sum(axis=1), axis=1)
