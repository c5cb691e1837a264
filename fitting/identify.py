"""Attitude and parameters of any satellite from whatever its sensors say: guesses, growing arcs, refinement."""

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.measurements.enough import check_sunlit
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.measurements.units import check_commands, check_field, check_spacing
from fitting.outcome.looking import prepare_look
from fitting.parameters.free import FreeParameters
from fitting.settings import FitSettings
from fitting.solvers.adaptive import panels_of, refine_adaptively
from fitting.solvers.refine import Refined, refine
from fitting.starts.before import Before
from fitting.starts.conventions import Convention, conventions, with_axes
from fitting.starts.growing import FIRST_ARC, Run
from fitting.starts.guess import Guess, place
from fitting.starts.ladder import directed_samples, telling_samples
from fitting.starts.multi_start import Progress, Starts, compile_solvers
from fitting.starts.search import Search, seen_rate
from fitting.starts.sights import sights_of
from fitting.starts.silent import silent_panels
from fitting.starts.stretches import longest_stretch, searched_samples
from jaxsat.errors import InputError
from jaxsat.integrators import RK4, step_for
from jaxsat.satellites.model import Model

COARSE_TOLERANCE, FINE_TOLERANCE = 4e-2, 2e-4
"""Integration error over the session allowed while arcs grow and at the end [rad]."""


HARDER, SHORTER = 3, 0.1
"""Times as many starts, of as many more steps, where the first arc is explained and the data are not; and the share of
the error allowed while arcs grow."""
MUCH_SHORTER, LEAST = 0.8, 0.1
"""Share of the step that was taken, below which one that the found motion needs is worth another round; the least."""


@dataclass(frozen=True)
class Minimum:
    """The best motion of one convention of axes."""

    convention: Convention
    problem: Problem
    refined: Refined

    @property
    def starts(self) -> Starts:
        """Where a refinement of it goes on."""
        points = self.refined.points
        return Starts(np.array(points.x), np.array(points.reference), self.refined.score)


@dataclass(frozen=True)
class Identified:
    """Minima by their score, best convention first, with the data that they explain."""

    minima: tuple[Minimum, ...]
    samples: Samples
    parameters: FreeParameters
    fitted: int
    """Samples that were fitted; those after them were held out."""
    finest_step: float
    """For which the programs have room [s]."""
    timing_s: dict[str, float]


def identify(
    samples: Samples,
    model: Model,
    around: Around,
    parameters: FreeParameters,
    settings: FitSettings,
    *,
    unknown_axes: dict[str, str],
    fit_until: float,
    delayed: tuple[str, ...],
    guess: Guess | None = None,
    progress: Progress = lambda *_: None,
) -> Identified:
    """Best motion and parameters by the samples up to `fit_until` [s]; the rest is predicted and not looked at.

    From a `guess` arcs grow on from it, and nothing is searched. Raises `InputError` where there are too few samples,
    not one sensor of panels for adaptive weights, no place for the guess, or a field that is of another size than
    IGRF's by far.
    """
    began = time.perf_counter()
    progress("preparing", 0, 1)
    if settings.adaptive.on:
        panels_of(model)
    fitted = int(np.searchsorted(samples.t, fit_until, side="right"))
    if fitted < FIRST_ARC:
        raise InputError(f"only {fitted} samples to fit; a fit needs at least {FIRST_ARC}")
    span = max(float(samples.t[fitted - 1] - samples.t[0]), 1.0)
    whole_span = max(float(np.ptp(samples.t)), 1.0)
    build = partial(build_problem, model=model, around=around, whole=samples, delayed=delayed)

    def steps_for(fastest: float) -> tuple[float, float]:
        """Longest step while arcs grow, and the shortest at the end, for motions of so many rad/s."""
        step = min(settings.step_s, step_for(RK4, fastest, span, COARSE_TOLERANCE))
        return step, min(step, step_for(RK4, 1.3 * fastest + 1e-3, whole_span, FINE_TOLERANCE))

    # The sky first: sights need no motion. In the shape that a motion as fast as is likely will have.
    fastest = float(np.radians(settings.max_rate_deg_s))
    first = build(samples, max_step=settings.step_s, room_for=steps_for(fastest)[1])
    check_spacing(first, samples)
    check_field(first, samples)
    check_commands(first, samples)
    check_sunlit(first, {name: channel.witness for name, channel in samples.channels.items()}, FIRST_ARC)
    seeing = samples.part(slice(fitted))
    found = conventions(first, seeing, unknown_axes)
    sights = sights_of(with_axes(first, found[0]), seeing)
    telling = telling_samples(sights)
    if len(telling) < FIRST_ARC:
        raise InputError(f"only {len(telling)} samples tell a direction; a fit needs at least {FIRST_ARC}")
    mask = np.isin(np.arange(len(samples.t)), telling)
    begin = longest_stretch(samples.t, mask) if samples.given is None else 0
    placed = None if guess is None else place(guess, samples, begin, fitted, telling)
    begin = begin if placed is None else placed.sample
    fastest = max(seen_rate(sights), fastest)
    if placed is not None:
        fastest = max(fastest, 1.3 * float(np.linalg.norm(placed.rate)))
    step, finest = steps_for(fastest)
    build = partial(build, room_for=finest, sky=first.sky)
    kept = searched_samples(samples, begin, fastest)
    thinned, fitted_of_kept = len(kept) < len(samples.t) - begin, int(np.searchsorted(kept, fitted))
    part, seeing = samples.part(kept), samples.part(kept[:fitted_of_kept])
    # Where the last rounds have another shape anyway, there is no room for their steps in that of the search.
    of_search = partial(build_problem, part, model, around, delayed=delayed, room_for=step)
    search_build = of_search if thinned else partial(build, part)
    coarse = search_build(max_step=step)
    whole = build(samples, max_step=step) if thinned else coarse
    tabulated = time.perf_counter()
    progress("compiling", 0, 1)
    compilations = compile_solvers(coarse, parameters, settings.solver)
    if thinned:
        # For the last rounds, of which the search knows nothing.
        compile_solvers(whole, parameters, settings.solver)
    # What looks at the minimum is traced while XLA, which needs no Python, is at work on the solver.
    threading.Thread(target=prepare_look, args=(whole, parameters), daemon=True).start()
    for compilation in compilations:
        if compilation is not None:
            compilation.result()
    compiled = time.perf_counter()

    use = usable(coarse, part)
    use[fitted_of_kept:] = 0.0
    silent, seen = silent_panels(seeing, model, parameters), directed_samples(sights)
    telling = np.flatnonzero(np.isin(kept, seen))
    search = Search(coarse, seeing, silent, telling, use, fastest, parameters, settings, progress)

    def weight_of(problem: Problem) -> np.ndarray:
        weight = usable(problem, samples)
        weight[fitted:] = 0.0
        return weight

    def before(convention: Convention) -> Before:
        # Kept: what lies before is looked at from the same sample more than once.
        @cache
        def problem_from(number: int) -> Problem:
            return with_axes(build(samples.part(slice(number, None)), max_step=step), convention)

        whole = problem_from(0)
        return Before(samples, whole.model, around, parameters, problem_from, weight_of(whole), seen, fitted - 1)

    def minimum(convention: Convention, problem: Problem, starts: Starts, hasty: bool = False) -> Minimum:
        how = (weight_of(problem), around, settings, progress, hasty)
        return Minimum(convention, problem, _refined(problem, parameters, starts, *how))

    def minima(starts: Sequence[tuple[Convention, Starts]], longest: float, hasty: bool = False) -> list[Minimum]:
        fine = build(samples, max_step=longest, room_for=min(longest, finest))
        found = [minimum(each, with_axes(fine, each), own, hasty) for each, own in starts if len(own.cost)]
        return [one for one in found if len(one.refined.score)]

    def best_of(runs: list[Run], hasty: bool) -> list[Minimum]:
        fine_step = _fine_step([search.spin(run) for run in runs], settings.step_s, whole_span)
        longest = max(min(step, fine_step), finest)
        starts = [(run.convention, run.starts) for run in runs]
        if begin > 0:
            starts = [(each, before(each).carried(own, begin, fine_step)) for each, own in starts]
        found = minima(starts, longest, hasty)
        # A motion may become faster than its start was; one that explains nothing may be of any speed.
        likely = [one for one in found if not one.refined.hopeless[0]]
        needed = _fine_step(_spins(likely, fitted), settings.step_s, whole_span) if samples.given is None else longest
        if likely and needed < MUCH_SHORTER * longest:
            again = [(one.convention, one.starts) for one in likely]
            found = minima(again, max(needed, LEAST * longest))
        return found

    if placed is not None:
        runs, begun = search.from_guess(found, placed), False
    else:
        runs, begun = search.along_given(found) if samples.given is not None else search.blind(found)
    best = best_of(runs, hasty=begun)
    if begun and _hopeless(best):
        # The model may be wrong; or a nearly chaotic motion needs shorter steps than its rate tells; or the way from
        # the first arc to the last is narrow, and too few starts were on it.
        shorter = max(min(step, step_for(RK4, fastest, span, SHORTER * COARSE_TOLERANCE)), finest)
        search = replace(search, problem=search_build(max_step=shorter))
        for effort in (1, HARDER) if shorter < MUCH_SHORTER * step else (HARDER,):
            again = best_of(search.blind(found, effort)[0], hasty=True)
            best += again
            if not _hopeless(again):
                break
    best.sort(key=lambda one: one.refined.score[0])
    if begun and best and _hopeless(best):
        best[0] = minimum(best[0].convention, best[0].problem, best[0].starts.take(np.array([0])))
    if not best:
        raise InputError("no start survives: the nominal satellite or the noise is out of all range")
    best.sort(key=lambda one: one.refined.score[0])
    timing = {"prepare": tabulated - began, "compile": compiled - tabulated, "solve": time.perf_counter() - compiled}
    return Identified(tuple(best), samples, parameters, fitted, finest, timing)


def _refined(problem, parameters, starts, weight, around, settings, progress, hasty) -> Refined:
    """The last steps by the likelihood, or by the rules of adaptive weights."""
    if settings.adaptive.on:
        radius = float(np.asarray(around.earth_radius))
        return refine_adaptively(problem, parameters, starts, weight, settings.adaptive, radius, progress)
    how = {"likelihood": settings.likelihood, "solver": settings.solver, "hasty": hasty}
    return refine(problem, parameters, starts, weight, **how, progress=progress)


def _hopeless(found: list[Minimum]) -> bool:
    """Whether none of them explains the data."""
    return all(one.refined.hopeless[0] for one in found)


def _spins(found: list[Minimum], fitted: int) -> list[float]:
    """Fastest rate of the best motion of each convention while it is fitted [rad/s]."""
    rates = [np.asarray(each.refined.points.prediction.angular_velocity)[0, :fitted] for each in found]
    return [float(np.linalg.norm(rate, axis=1).max()) for rate in rates]


def _fine_step(spins: list[float], longest: float, span: float) -> float:
    """Steps of the last rounds, by the fastest spin."""
    return min(longest, step_for(RK4, 1.3 * max(spins, default=0.0) + 1e-3, span, FINE_TOLERANCE))
