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
from fitting.starts.carry import carried_back
from fitting.starts.conventions import Convention
from fitting.starts.growing import Run, grow
from fitting.starts.ladder import directed_samples, first_guesses, telling_samples
from fitting.starts.multi_start import FEW, Starts
from fitting.starts.sights import sights_of
from fitting.starts.stretches import longest_stretch
from jaxsat.errors import InputError

LITTLE, MOST_CUTS = 4.0, 4
"""Sigmas by which residuals may change for their slopes to be those of a tangent; and how often a step is cut."""
PROMISE = 0.15
"""Share of what is unexplained that a look must promise for a refit."""


def searched(
    bench: Bench,
    samples: Samples,
    count: int,
    *,
    same_sky: bool = True,
    around: Around | None = None,
    parameters: FreeParameters | None = None,
    change: Callable[[Problem], Problem] = lambda problem: problem,
    last: int | None = None,
) -> Starts | None:
    """Where a search of `count` starts in changed data ends, at the first sample, best first; None where none survives.

    It begins at the longest stretch that sees something, as that of the fit. Of a part of the data the number of its
    `last` sample is given, and it begins at the first one.
    """
    parameters = parameters or bench.parameters
    same_sky = same_sky and around is None

    def problem_of(own: Samples) -> Problem:
        return change(bench.rebuilt(own, around, same_sky=same_sky, coarse=True))

    problem, part, begin = problem_of(samples), samples, 0
    sights = sights_of(problem, part)
    if last is None:
        last = len(samples.t) - (len(bench.samples.t) - bench.found.fitted) - 1
        seen = np.isin(np.arange(len(samples.t)), telling_samples(sights))
        begin = longest_stretch(samples.t, seen) if seen.sum() > 1 and bench.samples.given is None else 0
    if begin:
        part = samples.part(slice(begin, None))
        problem = problem_of(part)
        sights = sights_of(problem, part)
    use = bench.weight(problem, part)
    use[last - begin + 1 :] = 0.0
    guesses = first_guesses(sights, 0, count, bench.fastest, np.random.default_rng(bench.settings.seed))
    run = Run(Convention({}, 0.0), problem, guesses.starts(np.zeros(len(parameters.everything))))
    seen = directed_samples(sights)
    try:
        grow([run], seen[seen <= last - begin], last - begin, parameters, use, patient=False)
    except InputError:
        return None
    if begin:
        where = (samples, begin, problem.model, around or bench.around, bench.step)
        run.starts = carried_back(run.starts, parameters, *where)
    return run.starts if len(run.starts.cost) else None


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
    sky = {"around": around, "same_sky": same_sky and around is None}
    starts = searched(bench, samples, count, **sky, parameters=parameters, change=change)
    if starts is not None:
        yield bench.chi2_near(change(bench.rebuilt(samples, **sky)), first(starts), parameters=parameters)


def first(starts: Starts) -> Starts:
    """A few of the best."""
    return starts.take(np.arange(min(FEW, len(starts.cost))))


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
