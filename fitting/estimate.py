"""Attitude and parameters of a session from its panel currents: first guess, growing arcs, refinement, uncertainty."""

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import LIMB_FIELD, Observations, build_problem
from fitting.measurements.problem import Problem
from fitting.outcome.result import FitResult
from fitting.outcome.summary import describe, summarize
from fitting.parameters.nominal import Nominal
from fitting.parameters.parametrization import Parametrization, parametrization
from fitting.settings import FitSettings
from fitting.solvers.adaptive import refine_adaptively
from fitting.solvers.refine import Refined, candidates, refine
from fitting.starts.first_guesses import Sightings, filled_in, first_guesses, first_unknowns, silent_panels
from fitting.starts.multi_start import Progress, Starts, compile_solvers, grow
from fitting.starts.schedule import FIRST_ARC_LIT, arc_schedule
from fitting.starts.stretches import carried_to, longest_stretch
from jaxsat.errors import InputError
from jaxsat.integrators import RK4, step_for

COARSE_TOLERANCE, FINE_TOLERANCE = 4e-2, 2e-4
"""Integration error over the session allowed while arcs grow and at the end [rad]: inside every basin; a 20th sigma."""


def estimate(
    observations: Observations,
    nominal: Nominal,
    settings: FitSettings,
    *,
    progress: Progress = lambda *_: None,
    at_minimum: Callable[[Problem, Parametrization, Refined], object] = lambda *_: None,
) -> FitResult:
    """Best attitude motion and parameters of a session, with their uncertainty; a failure is a result, not an error.

    `at_minimum` is called with the problem on its fine grid and the minima, for what else is to be asked of them.
    The result starts at the arc's first sunlit sample. Raises `InputError` where fewer than `FIRST_ARC_LIT` are, and
    where limb angles are given but none from there on.
    """
    began = time.perf_counter()
    progress("preparing", 0, 1)
    noise = 1e-3 * settings.reading_sigma_mA
    duration = max(float(np.ptp(observations.t)), 1.0)
    max_rate = np.radians(settings.max_rate_deg_s)
    step = min(settings.step_s, step_for(RK4, max_rate, duration, COARSE_TOLERANCE))
    finest = min(step, step_for(RK4, _fastest(max_rate), duration, FINE_TOLERANCE))
    parameters = parametrization(nominal, settings.free_names, settings.prior_sigma)
    limb_sigma = None
    if settings.limb_weight > 0.0:
        limb_sigma = float(np.radians(settings.limb_sigma_deg) / np.sqrt(settings.limb_weight))
    else:
        observations = dataclasses.replace(observations, limb=None)
    # In the shape of the whole session, whatever is left out of it: like files share their programs.
    common: dict[str, Any] = {"whole": observations, "noise": noise, "room_for": finest}
    common |= {"limb_sigma": limb_sigma, "floor": settings.floor}
    coarse = build_problem(observations, max_step=step, **common)
    bright, sunlit = (each[: len(observations.t)] for each in (coarse.bright(), coarse.sunlit()))
    if (bright & sunlit).sum() < FIRST_ARC_LIT:
        raise InputError(
            f"only {(bright & sunlit).sum()} samples both outside the computed shadow and brighter than "
            f"{3e3 * noise:.0f} mA; a fit needs at least {FIRST_ARC_LIT}"
        )
    first = int(np.flatnonzero(bright & sunlit)[0])
    if first > 0:
        # The state is that at the arc's first sample, which must say something of it.
        observations = observations.since(first)
        coarse = build_problem(observations, max_step=step, **common)
        bright, sunlit = bright[first:], sunlit[first:]
    if coarse.limb is not None and not np.any(coarse.limb.known):
        reason = f"none is measured from the first sunlit sample on, t = {observations.t[0]:g} s"
        raise InputError(reason, field=LIMB_FIELD)
    begin = longest_stretch(observations.t, bright & sunlit)
    if begin > 0:
        coarse = build_problem(observations.since(begin), max_step=step, **common)
    searched = (bright & sunlit)[begin:]
    tabulated = time.perf_counter()
    # Programs compile in the background, in the order in which they are asked for, while the next one is traced.
    progress("compiling", 0, 1)
    first_lit = np.flatnonzero(searched)[:2]
    silent = silent_panels(observations.currents, noise, parameters)
    currents = filled_in(np.asarray(coarse.measured), noise, silent, nominal.max_current)
    seen = Sightings.of(coarse, parameters, currents, first_lit)
    guessing = (seen, jax.random.key(settings.seed), settings.starts, jnp.asarray(max_rate))
    first_guesses.compile(*guessing)
    compilations = compile_solvers(coarse, parameters, settings.solver)
    describe.compile(coarse, parameters, np.zeros(len(parameters.free)), np.zeros((len(coarse.valid), 4)))

    attitude, rate = first_guesses(*guessing)
    x = np.tile(first_unknowns(parameters, silent), (len(attitude), 1))
    x[:, 3:6] = np.asarray(rate) / RATE_UNIT
    starts = Starts(x, np.asarray(attitude), np.zeros(len(x)))
    for compilation in compilations:
        if compilation is not None:
            compilation.result()
    compiled = time.perf_counter()

    schedule = arc_schedule(searched, len(searched) - 1, settings.free_names)
    use = _usable(coarse, bright[begin:], sunlit[begin:])
    survivors = grow(coarse, parameters, schedule, starts, use, progress)
    if begin > 0:
        survivors = carried_to(survivors, parameters, observations, begin, finest)
    # The spin of the survivors, which is nonsense where it goes far beyond that of the starts.
    spin = RATE_UNIT * float(np.linalg.norm(survivors.x[candidates(survivors.cost), 3:6], axis=1).max())
    step = min(settings.step_s, step_for(RK4, min(_fastest(spin), 2.0 * max_rate), duration, FINE_TOLERANCE))
    fine = build_problem(observations, max_step=step, **common)
    use = _usable(fine, bright, sunlit)
    if not settings.adaptive.on:
        how = {"likelihood": settings.likelihood, "solver": settings.solver}
        refined = refine(fine, parameters, survivors, use, **how, progress=progress)
    else:
        rules, radius = settings.adaptive, observations.earth_radius
        refined = refine_adaptively(fine, parameters, survivors, use, rules, radius, progress)
    at_minimum(fine, parameters, refined)
    result = summarize(observations.t, fine, parameters, refined, dark_disagreement=int(np.sum(bright != sunlit)))
    timing = {"prepare": tabulated - began, "compile": compiled - tabulated, "solve": time.perf_counter() - compiled}
    return dataclasses.replace(result, timing_s=timing)


def _fastest(spin: float) -> float:
    """Highest rate in a session that begins with this one, with room for the swing of the magnet in the field."""
    return 1.3 * spin + 1e-3


def _usable(problem: Problem, bright: np.ndarray, sunlit: np.ndarray) -> np.ndarray:
    """[samples channels] 1 where a measurement counts, of samples that the arrays [time] say are bright and sunlit."""
    use = np.repeat(np.asarray(problem.valid).astype(float)[:, None], 6, axis=1)
    # A sample on the wrong side of a shadow edge by a second says nothing about attitude: leave it out.
    use[: len(bright)][bright != sunlit] = 0.0
    return use if problem.limb is None else np.hstack([use, np.asarray(problem.limb.known, float)])
