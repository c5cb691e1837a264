"""Searches on growing arcs with the data changed, and what promises to be worth a refit."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.lines import lowest
from fitting.doctor.trial import WORTH
from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.parameters.free import FreeParameters
from fitting.starts.conventions import Convention
from fitting.starts.growing import Run, grow
from fitting.starts.ladder import directed_samples, first_guesses
from fitting.starts.multi_start import CHUNK, Starts
from fitting.starts.sights import sights_of
from jaxsat.errors import InputError

LITTLE, MOST_CUTS = 4.0, 4
"""Sigmas by which residuals may change for their slopes to be those of a tangent; and how often a step is cut."""
PROMISE = 0.15
"""Share of what is unexplained that a look must promise for a refit."""


def searched(
    bench: Bench,
    problems: Sequence[tuple[Problem, Samples]],
    count: int,
    *,
    weight: np.ndarray | None = None,
    last: int | None = None,
    parameters: FreeParameters | None = None,
) -> list[Run]:
    """What a search of `count` starts for each problem leaves, best first; nothing where none survives.

    The number of a run's problem is the `mismatch` of its convention; `last` is that of the last sample of its arcs.
    """
    parameters = parameters or bench.parameters
    runs, use = [], None
    for number, (problem, samples) in enumerate(problems):
        sights = sights_of(problem, samples)
        rng = np.random.default_rng(bench.settings.seed)
        guesses = first_guesses(sights, 0, count, bench.fastest, rng)
        starts = guesses.starts(np.zeros(len(parameters.everything)))
        runs.append(Run(Convention({}, float(number)), problem, starts))
        use = bench.weight(problem, samples) if use is None else use
    if use is None:
        return []
    problem, samples = problems[0]
    seen = directed_samples(sights_of(problem, samples))
    if last is None:
        last = len(samples.t) - (len(bench.samples.t) - bench.found.fitted) - 1
    try:
        grow(runs, seen[seen <= last], last, parameters, use if weight is None else weight)
    except InputError:
        return []
    return runs


def anew(
    bench: Bench,
    samples: Samples,
    count: int,
    *,
    same_sky: bool = True,
    around: Around | None = None,
    parameters: FreeParameters | None = None,
    change: Callable[[Problem], Problem] = lambda problem: problem,
) -> Iterator[float]:
    """Chi2 of what a search finds, of problems that are changed; nothing where no start survives."""
    same_sky = same_sky and around is None
    coarse = change(bench.rebuilt(samples, around, same_sky=same_sky, coarse=True))
    runs = searched(bench, [(coarse, samples)], count, parameters=parameters)
    if runs:
        fine = change(bench.rebuilt(samples, around, same_sky=same_sky))
        yield bench.chi2_near(fine, first(runs[0].starts), parameters=parameters)


def first(starts: Starts) -> Starts:
    """As many of the best as one call of the solver takes."""
    return starts.take(np.arange(min(CHUNK, len(starts.cost))))


def along(
    bench: Bench,
    change: Callable[[float], Problem],
    unit: float,
    limits: tuple[float, float],
    anyway: Sequence[float] = (),
) -> tuple[float, float] | None:
    """The number by which problems are changed that has the lowest chi2, and that; None where it promises nothing.

    It is guessed by what a `unit` of it, either way, does to the residuals; then it is refitted for, and others near.
    Those that are tried `anyway` are for what carries a minimum to another one, where nothing explains the data.
    """
    size, fall = 0.0, 0.0
    for sign in (1.0, -1.0):
        step, column = _small_step(bench, change, sign * unit)
        sizes, saved = bench.score.fall(column[..., None], with_prior=False)
        # A column of one way tells of that way alone: lit and dark, bounds and floors are kinks.
        if saved > fall and sizes[0] > 0.0:
            size, fall = float(np.clip(step * sizes[0], *limits)), saved
    tried = [size, float(np.clip(1.6 * size, *limits))]
    if size == 0.0 or fall < max(WORTH, PROMISE * bench.unexplained):
        if bench.chi2 < bench.enough or not anyway:
            return None
        tried = list(anyway)

    def chi2(number: float) -> float:
        return bench.chi2_near(change(number))

    return lowest(chi2, tried, bench.chi2)


def _small_step(bench: Bench, change: Callable[[float], Problem], step: float) -> tuple[float, np.ndarray]:
    """A step, cut until residuals change by little, and by how much they do: small causes turn a long motion far.

    Nothing changes where the motion is then none that steps follow.
    """
    for _ in range(MOST_CUTS):
        column = changed_residual(bench, change(step)) - bench.score.residual
        largest = float(np.quantile(np.abs(column), 0.98))
        if not np.isfinite(largest):
            return step, np.zeros_like(column)
        if largest < LITTLE:
            break
        step *= 0.5 * LITTLE / largest
    return step, column


def changed_residual(bench: Bench, problem: Problem) -> np.ndarray:
    """[samples channels] residuals of the best minimum under another problem, where that counts them; else its own."""
    moved, _ = bench.look(problem, bench.parameters, bench.starts.x[0], bench.starts.reference[0])
    gone = (bench.weight(problem) == 0.0) & (bench.weight(bench.problem) > 0.0)
    return np.where(gone, bench.score.residual, moved)
