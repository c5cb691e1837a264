"""The last steps of a fit: whole arc, fine grid, samples that no attitude explains left out, minima compared."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.measurements.problem import CURRENTS, Problem
from fitting.outcome.uncertainty import at_bound, covariance, promised_saving
from fitting.parameters.parametrization import Parametrization
from fitting.solvers.least_squares import FINISHED_DECREMENT, LIMB_SCALE, Point, robust_loss
from fitting.starts.multi_start import NONE, Progress, Stage, Starts, distinct, solve

SAMPLE_LIMIT = 30.0
"""Sum of squared residuals over the six panels of a sample, in sigmas, beyond which its currents are left out.

Noise alone exceeds it once in 25 000 samples (chi-square, 6 degrees of freedom); a charge current limited to 80 %
exceeds it by far, for the brightest panel of a box never carries less than 58 % of its maximum current.
"""
MAX_LEFT_OUT = 0.35
"""Largest share of bright samples that may be left out; beyond it the model is wrong, not the samples."""
ROBUST_SCALE, PLAIN = 3.0, 1e4
TAIL = 6.0
"""Degrees of freedom of Student's distribution, as many as a sample has currents."""
CONVERGED_DECREMENT = 1e-2
"""An undamped step would improve the cost by less than this: a tenth of a sigma in every direction."""
MORE_ROUNDS = 6
"""Rounds more, with fresh damping, while a minimum is not reached so far."""
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
    "mixture": (Share(ceiling=SAMPLE_LIMIT), Share(leave_out=True)),
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
    """[minima samples] left out as inexplicable."""
    hopeless: np.ndarray
    """[minima] True where more samples than `MAX_LEFT_OUT` were inexplicable; then none was left out."""


def candidates(cost: np.ndarray) -> np.ndarray:
    """Indices of the minima that might still win, of costs in rising order: `MAX_MINIMA` of them at most.

    Nothing that is left out or freed later halves the cost of a wrong minimum alone.
    """
    return np.flatnonzero(cost <= 2.0 * cost[0] + 50.0)[:MAX_MINIMA]


def refine(
    problem: Problem,
    parameters: Parametrization,
    survivors: Starts,
    weight: np.ndarray,
    *,
    likelihood: str,
    progress: Progress,
    solver: str = Stage.solver,
) -> Refined:
    """Refines the best survivors on the problem's own grid, and ranks the minima by one truncated cost.

    `weight` [samples channels] is that of the measurements; `likelihood`, one of `LIKELIHOODS`, is that of the
    currents: a sample whose currents are left out keeps its limb angles; `solver` is one of `chunk.EVALUATIONS`.
    """
    chosen = survivors.take(candidates(survivors.cost))
    count = len(chosen.cost)
    last = int(np.flatnonzero(problem.valid)[-1])
    everything = np.ones(len(parameters.names), bool)
    weight = np.broadcast_to(weight, (count, *weight.shape))
    shares = LIKELIHOODS[likelihood]
    rounds = len(shares) + 1

    def run(number: int, stage: Stage, x: np.ndarray, reference: np.ndarray, weight: np.ndarray) -> Point:
        progress("refining", number, rounds)
        return solve(problem, parameters, stage, x, reference, weight)

    def settle(points: Point, number: int, stage: Stage, weight: np.ndarray) -> Point:
        # The other solvers, which are there to compare, take ten times as long.
        for _ in range(MORE_ROUNDS if solver == Stage.solver else 1):
            left = _unsettled(points, parameters)
            if len(left) == 0:
                break
            again = run(number, stage, np.asarray(points.x)[left], np.asarray(points.reference)[left], weight[left])
            # On a kink, where a panel's horizon passes a sample, a step promises what no step brings.
            ended = not np.any(again.cost < np.asarray(points.cost)[left] - FINISHED_DECREMENT)
            points = jax.tree.map(lambda old, new, left=left: _replaced(old, left, new), points, again)
            if ended:
                break
        return points

    stage = Stage(last, count, 12, ROBUST_SCALE, everything, solver=solver)
    # To the end: what is still on its way must not choose which samples are left out.
    points = settle(run(0, stage, chosen.x, chosen.reference, weight), 0, stage, weight)
    limited = np.zeros(weight.shape[:2], bool)
    hopeless = np.zeros(count, bool)
    used = (weight[..., :CURRENTS] > 0).any(axis=2)
    bright = used & (np.asarray(problem.measured).max(axis=1) > 0)
    for number, share in enumerate(shares, start=1):
        if share.leave_out:
            limited = (_sample_squares(points, weight) > SAMPLE_LIMIT) & used
            hopeless = limited.sum(axis=1) > MAX_LEFT_OUT * bright.sum(axis=1)
            limited &= ~hopeless[:, None]
        stage = Stage(last, count, 15, PLAIN, everything, share.tail, share.ceiling, solver=solver)
        kept = np.where(limited[..., None] & (np.arange(problem.channels) < CURRENTS), 0.0, weight)
        points = run(number, stage, np.asarray(points.x), np.asarray(points.reference), kept)
    points = settle(points, rounds - 1, stage, kept)
    # What more rounds have brought to explain the samples is not hopeless any more.
    of_samples = _sample_squares(points, weight)
    hopeless &= ((of_samples > SAMPLE_LIMIT) & used).sum(axis=1) > MAX_LEFT_OUT * bright.sum(axis=1)
    x, reference = np.asarray(points.x), np.asarray(points.reference)
    score = 0.5 * np.minimum(of_samples, SAMPLE_LIMIT).sum(axis=1)
    limb = jnp.asarray(points.prediction.residual)[..., CURRENTS:]
    squares = np.asarray(robust_loss(limb**2, np.asarray(LIMB_SCALE))) * weight[..., CURRENTS:]
    score = score + 0.5 * squares.sum(axis=(1, 2))
    score = score + 0.5 * (x[:, 6:] ** 2).sum(axis=1)
    order = distinct(Starts(x, reference, score), attitude=0.02, rate=2e-3)
    progress("refining", rounds, rounds)
    return Refined(jax.tree.map(lambda leaf: leaf[order], points), score[order], limited[order], hopeless[order])


def _unsettled(points: Point, parameters: Parametrization) -> np.ndarray:
    """Indices of minima that more steps would lower: of the best one, and of those that might become it."""
    costs = np.where(np.isfinite(points.cost), points.cost, np.inf)
    found = []
    for k in np.flatnonzero(np.isfinite(costs)):
        x, gradient, information = (np.asarray(leaf)[k] for leaf in (points.x, points.gradient, points.hessian))
        pressed = at_bound(x, gradient, parameters.bounds())
        promise = promised_saving(gradient, covariance(information, ~pressed), pressed)
        if promise > CONVERGED_DECREMENT and costs[k] - promise <= costs.min():
            found.append(k)
    return np.array(found, dtype=int)


def _replaced(old: np.ndarray, index: np.ndarray, new: np.ndarray) -> np.ndarray:
    """A copy of an array over the minima with those at `index` in place of the old ones."""
    result = np.array(old)
    result[index] = new
    return result


def _sample_squares(points: Point, weight: np.ndarray) -> np.ndarray:
    """[minima samples] sums over the currents of a sample."""
    return (np.asarray(points.prediction.residual)[..., :CURRENTS] ** 2 * weight[..., :CURRENTS]).sum(axis=-1)
