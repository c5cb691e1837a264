"""The last steps of a fit: whole arc, fine grid, samples that no attitude explains left out, minima compared."""

from dataclasses import dataclass

import jax
import numpy as np

from fitting.parameters import Parametrization
from fitting.problem import Problem
from fitting.solvers.least_squares import Point
from fitting.solvers.multi_start import Progress, Stage, Starts, distinct, solve

SAMPLE_LIMIT = 30.0
"""Sum of squared residuals over the six panels of a sample, in sigmas, beyond which it is left out.

Noise alone exceeds it once in 25 000 samples (chi-square, 6 degrees of freedom); a charge current limited to 80 %
exceeds it by far, for the brightest panel of a box never carries less than 58 % of its maximum current.
"""
MAX_LEFT_OUT = 0.35
"""Largest share of bright samples that may be left out; beyond it the model is wrong, not the samples."""
ROBUST_SCALE, PLAIN = 3.0, 1e4
MAX_MINIMA = 8
"""Minima compared on the whole arc."""


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
    sample_weight: np.ndarray,
    *,
    limiting: bool,
    progress: Progress,
) -> Refined:
    """Refines the best survivors on the problem's own grid, and ranks the minima by one truncated cost."""
    chosen = survivors.take(candidates(survivors.cost))
    count = len(chosen.cost)
    last = int(np.flatnonzero(problem.valid)[-1])
    rounds = 4 if limiting else 2
    everything = np.ones(len(parameters.names), bool)

    def stage(iterations: int, robust_scale: float) -> Stage:
        return Stage(last, count, iterations, robust_scale, everything)

    progress("refining", 0, rounds)
    weight = np.broadcast_to(sample_weight, (count, len(sample_weight)))
    points = solve(problem, parameters, stage(12, ROBUST_SCALE), chosen.x, chosen.reference, weight)
    limited = np.zeros(weight.shape, bool)
    hopeless = np.zeros(count, bool)
    bright = (sample_weight > 0) & (np.asarray(problem.measured).max(axis=1) > 0)
    for number in range(1, rounds):
        progress("refining", number, rounds)
        if limiting:
            limited = (_sample_squares(points) > SAMPLE_LIMIT) & (weight > 0)
            hopeless = limited.sum(axis=1) > MAX_LEFT_OUT * bright.sum()
            limited &= ~hopeless[:, None]
        x, reference = np.asarray(points.x), np.asarray(points.reference)
        points = solve(problem, parameters, stage(15, PLAIN), x, reference, np.where(limited, 0.0, weight))
    x, reference = np.asarray(points.x), np.asarray(points.reference)
    score = 0.5 * (np.minimum(_sample_squares(points), SAMPLE_LIMIT) * weight).sum(axis=1)
    score = score + 0.5 * (x[:, 6:] ** 2).sum(axis=1)
    order = distinct(Starts(x, reference, score), attitude=0.02, rate=2e-3)
    progress("refining", rounds, rounds)
    return Refined(jax.tree.map(lambda leaf: leaf[order], points), score[order], limited[order], hopeless[order])


def _sample_squares(points: Point) -> np.ndarray:
    return (np.asarray(points.prediction.residual) ** 2).sum(axis=-1)
