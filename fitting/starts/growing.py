"""The search itself: many starts on ever longer arcs, what is free growing with them."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.measurements.problem import Problem
from fitting.parameters.free import FreeParameters
from fitting.starts.cloud import ROBUST_SCALE, STRANGE, grown_slowly
from fitting.starts.conventions import MOST, Convention
from fitting.starts.multi_start import HOPELESS, NONE, Progress, Stage, Starts, advance, distinct
from jaxsat.errors import InputError
from jaxsat.satellites.model import INERTIA_PLACE

FIRST_ARC, ARC_GROWTH, ARC_ITERATIONS = 7, 1.57, 8
"""Telling samples of the first arc, how much longer each next one is, and the solver's steps on each."""
KEEP = (48, 32, 24, 16, 12, 8)
"""Starts that enter the second, third, ... arc; half of them of each convention where several are tried."""
TAIL = 6.0
"""Degrees of freedom of Student's distribution from there on: a limited current pulls at the motion no more."""


@dataclass
class Run:
    """The search under one convention of axes."""

    convention: Convention
    problem: Problem
    starts: Starts
    """Best first, once they have been moved."""


def grow(
    runs: list[Run],
    seen: np.ndarray,
    last: int,
    parameters: FreeParameters,
    use: np.ndarray,
    progress: Progress = lambda *_: None,
    *,
    effort: int = 1,
    patient: bool = True,
) -> bool:
    """Moves the starts on ever longer arcs, in place; those and conventions that are far worse than the best are gone.

    `seen` are the numbers of the samples that see something, `last` that of the last sample; `use` [samples channels]
    is the weight of the measurements; of `effort` times as many starts as usual as many more are kept, and take as many
    more steps. A `patient` search grows more slowly where an arc is lost. Returns whether a motion explains the first
    arc. Raises `InputError` where no start has a finite cost.
    """
    stages, tail, begun = arcs(seen, last, parameters, effort), NONE, True
    for number, stage in enumerate(stages):
        progress("growing arcs", number, len(stages))
        kept = [_best(run.starts, stage.keep if len(runs) < 4 else stage.keep // 2) for run in runs]
        _move(runs, kept, replace(stage, tail=tail), parameters, use)
        inside = int(np.searchsorted(seen, stage.last_sample, side="right"))
        strange = number > 0 and min(_least_cost(run) for run in runs) > STRANGE * inside
        if strange and number > 1 and tail == NONE and patient:
            arc = (stages[number - 1].last_sample, stage.last_sample)
            strange = not _move_slowly(runs, kept, arc, seen, parameters, use)
        if number == 1:
            begun = not strange
        elif strange and tail == NONE:
            # What was fitted so far and what is new exclude each other: something in the arc is of no motion.
            tail = TAIL
            both = [_best(run.starts, len(old.cost)).followed_by(old) for run, old in zip(runs, kept, strict=True)]
            _move(runs, both, replace(stage, tail=tail), parameters, use)
        runs[:] = [run for run in runs if len(run.starts.cost)]
        if not runs:
            raise InputError("no start gives finite readings: the nominal satellite or the noise is out of all range")
        runs.sort(key=lambda run: run.starts.cost[0])
        if number > 0:
            limit = HOPELESS[0] * runs[0].starts.cost[0] + HOPELESS[1]
            for run in runs:
                run.starts = run.starts.take(np.flatnonzero(run.starts.cost <= limit))
            runs[:] = [run for run in runs if len(run.starts.cost)]
            # The longer the arc, the fewer conventions can be meant.
            del runs[max(MOST >> number, 3) :]
    # Nothing that the fine grid or a sample left out changes halves the cost of a wrong convention alone.
    runs[:] = [run for run in runs if run.starts.cost[0] <= 2.0 * runs[0].starts.cost[0] + 50.0]
    progress("growing arcs", len(stages), len(stages))
    return begun


def _best(starts: Starts, most: int) -> Starts:
    return starts.take(np.arange(min(most, len(starts.cost))))


def _move(runs: list[Run], starts: list[Starts], stage: Stage, parameters: FreeParameters, use: np.ndarray) -> None:
    """Each run's starts are where these end on an arc, best first, without repetitions."""
    for run, own in zip(runs, starts, strict=True):
        moved = advance(run.problem, parameters, stage, own, use)
        run.starts = moved.take(distinct(moved, attitude=2e-3, rate=2e-3))


def _move_slowly(
    runs: list[Run],
    starts: list[Starts],
    arc: tuple[int, int],
    seen: np.ndarray,
    parameters: FreeParameters,
    use: np.ndarray,
) -> bool:
    """Moves the starts from one arc to the next in small steps; whether some motion then explains it, else nothing."""
    moved = False
    for run, own in zip(runs, starts, strict=True):
        found = grown_slowly(run.problem, parameters, own, arc, seen, use) if len(own.cost) else None
        if found is not None:
            run.starts, moved = found, True
    return moved


def _least_cost(run: Run) -> float:
    return float(run.starts.cost[0]) if len(run.starts.cost) else np.inf


def arcs(seen: np.ndarray, last: int, parameters: FreeParameters, effort: int = 1) -> list[Stage]:
    """Arcs by their number of samples that see something; what is free grows with them, under the priors."""
    names = [leaf.name for leaf in parameters.leaves]
    inertia = {leaf.name for leaf in parameters.leaves if leaf.place == INERTIA_PLACE}
    state, everything = parameters.active([]), parameters.everything
    without_inertia = parameters.active([name for name in names if name not in inertia])

    def stage(sample: int, keep: int, iterations: int, active: np.ndarray) -> Stage:
        return Stage(sample, keep * effort, iterations * effort, ROBUST_SCALE, active)

    first, *longer = arc_ends(seen, last)
    stages = [stage(first, 10**9, 5, state), stage(first, KEEP[0], ARC_ITERATIONS, without_inertia)]
    for sample in longer:
        keep = KEEP[min(len(stages) - 1, len(KEEP) - 1)]
        stages.append(stage(sample, keep, ARC_ITERATIONS, without_inertia if len(stages) == 2 else everything))
    return stages


def arc_ends(seen: np.ndarray, last: int) -> list[int]:
    """Last sample of each arc, of samples that see something; that of the last arc is `last`."""
    count: int | float = FIRST_ARC
    ends = []
    while not ends or ends[-1] < last:
        whole = count * 1.2 >= len(seen)
        ends.append(last if whole else int(seen[int(round(count)) - 1]))
        count *= ARC_GROWTH
    return ends
