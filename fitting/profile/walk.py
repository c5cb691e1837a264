"""The walk along a profile: from a minimum outward on both sides of one unknown, the others solved for at each step."""

from dataclasses import dataclass

import jax
import numpy as np

from fitting.measurements.abstract import AbstractProblem
from fitting.parameters.free import FreeParameters
from fitting.solvers.least_squares import Point
from fitting.solvers.refine import CONVERGED_DECREMENT, PLAIN
from fitting.starts.multi_start import Progress, Stage, solve

SPACING = 0.8
"""Distance between two points aimed at, as a difference of roots of twice the cost's rise [sigma]."""
WIDEST = 1.5
"""Distance beyond which a gap is halved [sigma]."""
ROUNDS, HALVINGS = 6, 2
"""Steps outward, and of filling gaps, before the walk ends where it is: four points each."""
ITERATIONS = 25


@dataclass(frozen=True)
class Held:
    """What is held on the way."""

    unknown: int
    """Number of the unknown that is stepped through."""
    held: np.ndarray
    """[unknowns] bool: that one, and others that stay at the minimum's."""
    spread: float
    """1-sigma of the unknown, the scale of the first steps."""


@dataclass(frozen=True)
class Step:
    """A point of the walk: the lowest cost at this offset of the held unknown."""

    offset: float
    """Of the held unknown from the minimum."""
    x: np.ndarray
    reference: np.ndarray
    hessian: np.ndarray
    rise: float
    """Cost above the minimum's."""
    settled: bool

    @property
    def root(self) -> float:
        """Distance in sigmas that the rise stands for, with the sign of the offset."""
        return float(np.copysign(np.sqrt(2.0 * max(self.rise, 0.0)), self.offset))


def walk(
    problem: AbstractProblem,
    parameters: FreeParameters,
    best: Point,
    hold: Held,
    *,
    reach: float,
    tail: float,
    progress: Progress,
) -> list[Step]:
    """Points by rising offset, out to a rise of reach^2 / 2 on both sides, to a bound, or as far as `ROUNDS` lead."""
    # What was held out takes no part in the cost.
    last = int(np.flatnonzero(np.asarray(best.weight).any(axis=1))[-1])
    moving = parameters.everything & ~hold.held
    stage = Stage(last, 1, ITERATIONS, PLAIN, moving, tail=tail)
    lower, upper = parameters.bounds()
    k = hold.unknown
    limits = {-1: float(lower[k] - best.x[k]), 1: float(upper[k] - best.x[k])}
    title = f"profile of {parameters.names[k]}"

    def settle(wanted: list[tuple[float, Step]]) -> list[Step]:
        starts = [_predict(near, offset, hold.unknown, moving) for offset, near in wanted]
        x = np.clip(np.array(starts), lower, upper)
        reference = np.array([near.reference for _, near in wanted])
        points = solve(problem, parameters, stage, x, reference, np.asarray(best.weight))
        each = [jax.tree.map(lambda leaf, n=n: leaf[n], points) for n in range(len(wanted))]
        return [_step(offset, point, best) for (offset, _), point in zip(wanted, each, strict=True)]

    steps = [_step(0.0, best, best)]
    width = {-1: SPACING * hold.spread, 1: SPACING * hold.spread}
    for number in range(ROUNDS):
        progress(title, number, ROUNDS + HALVINGS)
        ends = {sign: max(steps, key=lambda step, sign=sign: sign * step.offset) for sign in (-1, 1)}
        wanted = []
        for sign, end in ends.items():
            if abs(end.root) < reach and end.offset != limits[sign]:
                reached = [end.offset + sign * n * width[sign] for n in (1, 2)]
                inside = sorted({sign * min(sign * offset, sign * limits[sign]) for offset in reached})
                wanted += [(offset, end) for offset in inside]
        if not wanted:
            break
        steps += settle(wanted)
        for sign, end in ends.items():
            new = max(steps, key=lambda step, sign=sign: sign * step.offset)
            gained = abs(new.root) - abs(end.root)
            taken = abs(new.offset - end.offset) / width[sign]
            # A flat stretch is crossed in longer steps, a steep one in shorter, neither in leaps.
            width[sign] *= float(np.clip(SPACING * taken / max(gained, 1e-9), 0.25, 4.0)) if taken else 1.0
    for number in range(HALVINGS):
        progress(title, ROUNDS + number, ROUNDS + HALVINGS)
        steps.sort(key=lambda step: step.offset)
        wide = [
            (0.5 * (a.offset + b.offset), min(a, b, key=lambda step: abs(step.offset)))
            for a, b in zip(steps[:-1], steps[1:], strict=True)
            if abs(b.root - a.root) > WIDEST and min(abs(a.root), abs(b.root)) < reach
        ]
        if not wide:
            break
        steps += settle(wide)
    progress(title, ROUNDS + HALVINGS, ROUNDS + HALVINGS)
    return sorted(steps, key=lambda step: step.offset)


def _step(offset: float, point: Point, best: Point) -> Step:
    return Step(
        offset=offset,
        x=np.asarray(point.x),
        reference=np.asarray(point.reference),
        hessian=np.asarray(point.hessian),
        rise=float(point.cost - best.cost),
        settled=bool(point.decrement <= CONVERGED_DECREMENT),
    )


def _predict(near: Step, offset: float, k: int, others: np.ndarray) -> np.ndarray:
    """Where the `others` [unknowns bool] go, by the quadratic model at a neighbour, as number `k` moves to `offset`."""
    shift = np.zeros(len(near.x))
    shift[k] = offset - near.offset
    matrix = near.hessian[np.ix_(others, others)]
    root = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    response, *_ = np.linalg.lstsq(matrix / np.outer(root, root), near.hessian[others, k] / root)
    shift[others] = -response / root * shift[k]
    return near.x + shift
