"""Attitude and parameters of any satellite from whatever its sensors say: guesses, growing arcs, refinement."""

import threading
import time
from dataclasses import dataclass

import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.measurements.enough import check_sunlit
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.outcome.looking import prepare_look
from fitting.parameters.free import FreeParameters
from fitting.settings import FitSettings
from fitting.solvers.adaptive import panels_of, refine_adaptively
from fitting.solvers.refine import Refined, candidates, refine
from fitting.starts.carry import carried_back
from fitting.starts.conventions import Convention, conventions, with_axes
from fitting.starts.growing import FIRST_ARC, Run, grow
from fitting.starts.ladder import directed_samples, first_guesses, telling_samples
from fitting.starts.mounting import with_turns
from fitting.starts.multi_start import Progress, compile_solvers
from fitting.starts.sights import Sights, sights_of
from fitting.starts.silent import silent_panels
from fitting.starts.stretches import longest_stretch
from jaxsat.errors import InputError
from jaxsat.integrators import RK4, step_for
from jaxsat.math.on_host import angles_between
from jaxsat.satellites.model import Model

COARSE_TOLERANCE, FINE_TOLERANCE = 4e-2, 2e-4
"""Integration error over the session allowed while arcs grow and at the end [rad]."""


HARDER = 3
"""Times as many starts, of as many more steps, where the first arc is explained and the data are not."""
MOST_GIVEN = 8
"""Conventions of axes that are refined along a motion that is given."""


@dataclass(frozen=True)
class Minimum:
    """The best motion of one convention of axes."""

    convention: Convention
    problem: Problem
    refined: Refined


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
    progress: Progress = lambda *_: None,
) -> Identified:
    """Best motion and parameters by the samples up to `fit_until` [s]; the rest is predicted and not looked at.

    Raises `InputError` where there are too few samples, or not one sensor of panels for adaptive weights.
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
    build = {"whole": samples, "delayed": delayed}
    # The sky first, on the coarsest grid: sights need no motion.
    first = build_problem(samples, model, around, max_step=settings.step_s, room_for=settings.step_s, **build)
    check_sunlit(first, {name: channel.witness for name, channel in samples.channels.items()}, FIRST_ARC)
    seeing = samples.part(slice(fitted))
    found = conventions(first, seeing, unknown_axes)
    sights = sights_of(with_axes(first, found[0]), seeing)
    fastest = max(_seen_rate(sights), float(np.radians(settings.max_rate_deg_s)))
    step = min(settings.step_s, step_for(RK4, fastest, span, COARSE_TOLERANCE))
    finest = min(step, step_for(RK4, 1.3 * fastest + 1e-3, whole_span, FINE_TOLERANCE))
    telling = telling_samples(sights)
    if len(telling) < FIRST_ARC:
        raise InputError(f"only {len(telling)} samples tell a direction; a fit needs at least {FIRST_ARC}")
    mask = np.isin(np.arange(len(samples.t)), telling)
    begin = longest_stretch(samples.t, mask) if samples.given is None else 0
    part, seeing = samples.part(slice(begin, None)), seeing.part(slice(begin, None))
    coarse = build_problem(part, model, around, max_step=step, room_for=finest, sky=first.sky, **build)
    tabulated = time.perf_counter()
    progress("compiling", 0, 1)
    compilations = compile_solvers(coarse, parameters, settings.solver)
    # What looks at the minimum is traced while XLA, which needs no Python, is at work on the solver.
    threading.Thread(target=prepare_look, args=(coarse, parameters), daemon=True).start()
    for compilation in compilations:
        if compilation is not None:
            compilation.result()
    compiled = time.perf_counter()

    silent = silent_panels(seeing, model, parameters)
    use = usable(coarse, part)
    use[fitted - begin :] = 0.0
    seen = directed_samples(sights)

    def started(convention: Convention, effort: int) -> Run:
        problem = with_axes(coarse, convention)
        count = settings.starts * effort if samples.given is None else 1
        rng = np.random.default_rng([settings.seed, effort - 1])
        guesses = first_guesses(sights_of(problem, seeing), 0, count, fastest, rng)
        starts = guesses.starts(np.zeros(len(parameters.everything)))
        if silent.panels:
            guesses = first_guesses(sights_of(problem, silent.left_out(seeing)), 0, count, fastest, rng)
            starts = starts.followed_by(guesses.starts(silent.unknowns(parameters)))
        return Run(convention, problem, starts)

    def searched(effort: int) -> tuple[list[Minimum], bool]:
        begun = False
        runs = [started(each, effort) for each in (found if samples.given is None else found[:MOST_GIVEN])]
        if samples.given is None:
            begun = grow(
                runs, seen[seen >= begin] - begin, fitted - begin - 1, parameters, use, progress, effort=effort
            )
        else:
            for run in runs:
                run.starts = with_turns(run.starts, run.problem, seeing, parameters)
        fine_step = _fine_step(runs, settings.step_s, whole_span)
        longest = max(min(step, fine_step), finest)
        fine = build_problem(samples, model, around, max_step=longest, room_for=finest, sky=first.sky, **build)
        weight = usable(fine, samples)
        weight[fitted:] = 0.0
        minima = []
        for run in runs:
            problem = with_axes(fine, run.convention)
            starts = run.starts
            if begin > 0:
                starts = carried_back(starts, parameters, samples, begin, problem.model, around, fine_step)
            if len(starts.cost):
                refined = _refined(problem, parameters, starts, weight, around, settings, progress)
                minima.append(Minimum(run.convention, problem, refined))
        return minima, begun

    minima, begun = searched(1)
    if begun and all(minimum.refined.hopeless[0] for minimum in minima):
        # The model may be wrong; or the way from the first arc to the last is narrow, and too few starts were on it.
        minima += searched(HARDER)[0]
    if not minima:
        raise InputError("no start survives: the nominal satellite or the noise is out of all range")
    minima.sort(key=lambda minimum: minimum.refined.score[0])
    timing = {"prepare": tabulated - began, "compile": compiled - tabulated, "solve": time.perf_counter() - compiled}
    return Identified(tuple(minima), samples, parameters, fitted, finest, timing)


def _refined(problem, parameters, starts, weight, around, settings, progress) -> Refined:
    """The last steps by the likelihood, or by the rules of adaptive weights."""
    if settings.adaptive.on:
        radius = float(np.asarray(around.earth_radius))
        return refine_adaptively(problem, parameters, starts, weight, settings.adaptive, radius, progress)
    how = {"likelihood": settings.likelihood, "solver": settings.solver}
    return refine(problem, parameters, starts, weight, **how, progress=progress)


def _seen_rate(sights: Sights) -> float:
    """A rate that the satellite is not much faster than, as far as gyroscope or finite turns show it [rad/s]."""
    known = np.isfinite(sights.rate).all(axis=1)
    if known.any():
        return 1.3 * float(np.quantile(np.linalg.norm(sights.rate[known], axis=1), 0.9))
    fastest = 0.0
    for directions in sights.directions:
        good = np.flatnonzero(np.isfinite(directions.body).all(axis=1))
        if len(good) > 3:
            angle = angles_between(directions.body[good[1:]], directions.body[good[:-1]])
            # A direction that turns with the body at less than its whole rate: the axis may lie near it.
            fastest = max(fastest, 1.3 * float(np.quantile(angle / np.diff(sights.t[good]), 0.8)))
    return fastest


def _fine_step(runs: list[Run], longest: float, span: float) -> float:
    """Steps of the last rounds, by the spin of the survivors."""
    spins = [RATE_UNIT * np.linalg.norm(run.starts.x[candidates(run.starts.cost), 3:6], axis=1).max() for run in runs]
    return min(longest, step_for(RK4, 1.3 * float(max(spins)) + 1e-3, span, FINE_TOLERANCE))
