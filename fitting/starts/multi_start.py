"""Growing arcs: many starts on a short arc, the best of them on ever longer ones (Penkov et al. 2009, end of sec. 4).

The cost as a function of the spin rate has a side minimum every 2 x 4.49/T rad/s, so over a whole session almost
every start ends in a wrong one, while over the first few minutes the basin is wide. Each arc is long enough to halve
the spread of the survivors' rates and short enough that they stay inside the basin of the next.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import jax
import numpy as np

from fitting.measurements.abstract import RATE_UNIT, AbstractProblem
from fitting.parameters.free import FreeParameters
from fitting.solvers.chunk import EVALUATIONS, solve_chunk
from fitting.solvers.least_squares import Point, Settings
from jaxsat.integrators import BLOCK

CHUNK, LONG = 16, 1000
"""Starts in one call of the compiled program, and samples beyond which it is one: their points would fill memory."""
FEW = 4
"""Of the best starts, where a search is tried again with something changed."""

HOPELESS = (5.0, 300.0)
"""A start is given up once its cost exceeds the first times the best one's plus the second.

Not after the first stage, where most starts are still on their way."""

NONE = 1e15
"""A tail or a ceiling that is not there."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Stage:
    """One arc of the schedule."""

    last_sample: int
    """Index of the arc's last sample."""
    keep: int
    """Starts that enter this stage, best first."""
    iterations: int
    robust_scale: float
    active: np.ndarray
    """[unknowns] or [starts unknowns] bool."""
    tail: float = NONE
    ceiling: float = NONE
    """As in `Settings`."""
    solver: str = "levenberg_marquardt"
    """One of `chunk.EVALUATIONS`."""


@dataclass(frozen=True)
class Starts:
    """A set of points on the host, sorted by the caller."""

    x: np.ndarray
    reference: np.ndarray
    cost: np.ndarray

    def take(self, index: np.ndarray) -> "Starts":
        """The points at `index`, in that order."""
        return Starts(self.x[index], self.reference[index], self.cost[index])

    def followed_by(self, others: "Starts") -> "Starts":
        """These, and the others behind them."""
        pairs = ((self.x, others.x), (self.reference, others.reference), (self.cost, others.cost))
        return Starts(*(np.concatenate(pair) for pair in pairs))


def solve(
    problem: AbstractProblem,
    parameters: FreeParameters,
    stage: Stage,
    x: np.ndarray,
    reference: np.ndarray,
    weight: np.ndarray,
) -> Point:
    """Minima of any number of starts as whole points, which are large: for a few of them."""
    return _solve(problem, parameters, stage, x, reference, weight, lambda point: point)


def advance(
    problem: AbstractProblem, parameters: FreeParameters, stage: Stage, starts: Starts, weight: np.ndarray
) -> Starts:
    """Where any number of starts end, and at what cost."""
    points = _solve(
        problem,
        parameters,
        stage,
        starts.x,
        starts.reference,
        weight,
        lambda point: (point.x, point.reference, point.cost),
    )
    return Starts(*points)


def rates_of(
    problem: AbstractProblem, parameters: FreeParameters, last: int, starts: Starts, weight: np.ndarray
) -> np.ndarray:
    """[starts samples] rate of each motion up to sample `last` [rad/s]."""
    # Evaluated and not moved.
    stage = Stage(last, len(starts.cost), 0, NONE, parameters.everything)
    common = (stage, starts.x, starts.reference, weight)
    rates = _solve(problem, parameters, *common, lambda point: point.prediction.angular_velocity)
    return np.linalg.norm(rates[:, : last + 1], axis=-1)


def _solve(problem, parameters, stage, x, reference, weight, select: Callable[[Point], Any]) -> Any:
    """What `select` takes of the minima of any number of starts.

    Chunks of fixed shape, of which only the starts that there are are solved, on two threads.

    `weight` is [samples channels] or [starts samples channels]; samples after the stage's arc are left out here.
    """
    count, together = len(x), _together(problem)
    inside = np.arange(weight.shape[-2]) <= stage.last_sample
    weight = np.broadcast_to(weight * inside[:, None], (count, len(inside), weight.shape[-1]))
    active = np.broadcast_to(stage.active, x.shape)
    settings, bounds = _settings(problem, stage), parameters.bounds()

    def run(part):
        padded = np.pad(part, (0, together - len(part)), mode="edge")
        own = replace(settings, active=active[padded])
        arguments = (problem, parameters.tree, stage.solver, own, bounds)
        points = solve_chunk(*arguments, x[padded], reference[padded], weight[padded], np.asarray(len(part)))
        return jax.tree.map(lambda leaf: leaf[: len(part)], jax.device_get(select(points)))

    # XLA runs a program of this size on one core and releases the GIL: two threads use two cores.
    with ThreadPoolExecutor(2) as pool:
        points = list(pool.map(run, np.split(np.arange(count), _ends(count, together))))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *points)


def compile_solvers(problem: AbstractProblem, parameters: FreeParameters, solver: str) -> list[Future | None]:
    """Starts the compilation of what growing arcs and refinement by `solver` need in the background.

    See `Stored.compile`.
    """
    unknowns, samples, together = len(parameters.everything), len(problem.valid), _together(problem)
    settings = _settings(problem, Stage(0, 1, 0, 1.0, np.zeros((together, unknowns), bool)))
    starts = (np.zeros((together, unknowns)), np.zeros((together, 4)), np.zeros((together, samples, problem.channels)))
    starts = (*starts, np.asarray(together))
    common = (settings, parameters.bounds(), *starts)
    return [
        solve_chunk.compile(problem, parameters.tree, name, *common) for name in dict.fromkeys((Stage.solver, solver))
    ]


def _ends(count: int, together: int) -> np.ndarray:
    """Where so many starts are parted: into equal shares for two threads, none above what one call takes."""
    calls = min(2 * -(-count // (2 * together)), count)
    return np.linspace(0, count, calls + 1).round().astype(int)[1:-1]


def _together(problem: AbstractProblem) -> int:
    """Starts in one call."""
    return CHUNK if len(problem.valid) <= LONG else 1


def _settings(problem: AbstractProblem, stage: Stage) -> Settings:
    steps = int(np.asarray(problem.grid.sample_index)[stage.last_sample])
    return Settings(
        blocks=np.asarray(-(-steps // BLOCK)),
        iterations=np.asarray(stage.iterations * EVALUATIONS[stage.solver]),
        robust_scale=np.asarray(float(stage.robust_scale)),
        tail=np.asarray(float(stage.tail)),
        ceiling=np.asarray(float(stage.ceiling)),
        active=np.asarray(stage.active),
    )


def carried(
    starts: Starts,
    together: int,
    carry: Callable[[np.ndarray, np.ndarray], tuple[Any, Any]],
) -> Starts:
    """Starts at another time: `carry(x, reference)` gives attitude and angular velocity [rad/s] of so many there."""
    count = len(starts.cost)
    order = np.concatenate([np.arange(count), np.zeros(-count % together, dtype=int)])
    parts = np.split(order, len(order) // together)
    found = [jax.device_get(carry(starts.x[part], starts.reference[part])) for part in parts]
    reference, rate = (np.concatenate(each)[:count] for each in zip(*found, strict=True))
    x = starts.x.copy()
    x[:, :3], x[:, 3:6] = 0.0, rate / RATE_UNIT
    # A start that has run away while it was carried is none.
    good = np.isfinite(reference).all(axis=1) & np.isfinite(rate).all(axis=1)
    return Starts(x, reference, starts.cost).take(np.flatnonzero(good))


def distinct(points: Starts, *, attitude: float, rate: float) -> np.ndarray:
    """Indices of points, best first, that differ from every better one by an attitude [rad] or a rate [x units]."""
    finite = np.flatnonzero(np.isfinite(points.cost))
    order = finite[np.argsort(points.cost[finite], kind="stable")]
    kept: list[int] = []
    for k in order:
        others = np.array(kept, dtype=int)
        overlap = np.abs(points.reference[others] @ points.reference[k])
        angle = 2.0 * np.arccos(np.minimum(overlap, 1.0))
        spread = np.linalg.norm(points.x[others, 3:6] - points.x[k, 3:6], axis=-1)
        if not np.any((angle < attitude) & (spread < rate)):
            kept.append(int(k))
    return np.array(kept, dtype=int)
