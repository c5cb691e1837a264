"""Attitude and parameters of a session from its panel currents: first guess, growing arcs, refinement, uncertainty."""

import dataclasses
import time
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.local.roll_search import search_roll
from fitting.parameters import DYNAMIC, STATE, Nominal, Parametrization, PriorSigma, build_model, parametrization
from fitting.problem import PAD_SAMPLES, PAD_STEPS, RATE_UNIT, Problem
from fitting.refine import refine
from fitting.result import FitResult
from fitting.solvers.multi_start import Progress, Stage, Starts, grow
from fitting.starts import random_starts
from fitting.summary import summarize
from jaxsat.environment import (
    CylinderShadow,
    DiffuseAlbedo,
    InternalField,
    KeplerOrbit,
    SpecularAlbedo,
    tabulate_light,
    tabulate_orbit,
)
from jaxsat.errors import InputError
from jaxsat.integrators import StepGrid, rk4_step_for
from jaxsat.math import quaternion

FIRST_ARC_LIT, ARC_GROWTH = 7, 1.57
"""Lit samples of the first arc, and how much longer each next one is: by 2 it loses sessions, by 1.5 none."""
KEEP = (64, 48, 32, 24, 16, 8)
"""Starts that enter the second, third, ... arc."""
COARSE_TOLERANCE, FINE_TOLERANCE = 1e-2, 5e-5
"""Integration error allowed while arcs grow and at the end [rad]: far inside every basin; a fiftieth of a sigma."""


FINEST_USUAL_STEP_S = 8.0
"""Grids are padded to the number of steps of this length [s]; a faster spin costs one more compilation."""


@dataclass(frozen=True)
class FitSettings:
    """Choices of one fit."""

    free: tuple[str, ...]
    """From `fitting.parameters.parse_free`."""
    starts: int = 256
    seed: int = 0
    noise_mA: float = 2.0
    """1-sigma of one current."""
    quantum_mA: float = 1.0
    """Step of the telemetered currents; its rounding adds quantum^2 / 12 to the variance."""
    max_rate_deg_s: float = 1.5
    step_s: float = 32.0
    """Longest integration step; shorter ones are taken where the rate asks for them."""
    limiting: bool = True
    """Leave out samples whose currents no attitude explains, as under a limited charge current."""
    prior: PriorSigma = PriorSigma()


@dataclass(frozen=True)
class Observations:
    """Samples of one session with their surroundings, SI; time zero is that of the orbit."""

    t: np.ndarray
    """[time] increasing [s]."""
    currents: np.ndarray
    """[time 6] +X -X +Y -Y +Z -Z [A]."""
    orbit: KeplerOrbit
    field: InternalField
    greenwich_angle: float
    """At t = 0 [rad]."""
    earth_rotation_rate: float
    """[rad/s]"""
    earth_radius: float
    """Of shadow and albedo [m]."""
    sun_eci: np.ndarray
    """[time 3] unit vectors."""


@eqx.filter_jit
def _tabulate(orbit, field, greenwich, rate, radius, node_times, sample_times, sun_eci):
    light = tabulate_light(
        orbit,
        sample_times,
        sun_eci,
        shadow=CylinderShadow(radius),
        specular=SpecularAlbedo(radius),
        diffuse=DiffuseAlbedo(radius),
    )
    return tabulate_orbit(orbit, node_times, field, greenwich, rate), light


def build_problem(observations: Observations, *, noise: float, max_step: float) -> Problem:
    """Tables and padded measurements for steps of at most `max_step` [s]; `noise` is one sigma [A]."""
    t = observations.t
    # Steps are padded generously, so that the coarse and the fine grid of a session share one program.
    steps = len(StepGrid.through(t, start=t[0], max_step=FINEST_USUAL_STEP_S).step)
    pad_steps = -(-steps // PAD_STEPS) * PAD_STEPS
    grid = StepGrid.through(t, start=t[0], max_step=max_step, pad_samples=PAD_SAMPLES, pad_steps=pad_steps)
    extra = len(grid.sample_index) - len(t)
    sun = np.pad(observations.sun_eci, ((0, extra), (0, 0)), mode="edge")
    orbit_table, light = _tabulate(
        observations.orbit,
        observations.field,
        jnp.asarray(observations.greenwich_angle),
        jnp.asarray(observations.earth_rotation_rate),
        jnp.asarray(observations.earth_radius),
        grid.node_times,
        np.pad(t, (0, extra), mode="edge"),
        sun,
    )
    return Problem(
        grid=grid,
        orbit=orbit_table,
        light=light,
        measured=np.pad(observations.currents, ((0, extra), (0, 0))),
        valid=np.arange(len(grid.sample_index)) < len(t),
        noise=np.asarray(noise),
    )


def arc_schedule(lit: np.ndarray, last: int, free: tuple[str, ...]) -> list[Stage]:
    """Arcs by their number of lit samples; what is free grows with them, under the priors."""
    position = np.flatnonzero(lit)
    names = np.array([*STATE, *free])
    state = np.isin(names, [*STATE, "albedo.specular", "albedo.diffuse"])
    early = state | ~np.isin(names, [name for name in DYNAMIC if name.startswith("inertia")])
    active = [state, early]
    stages: list[Stage] = []
    count = float(FIRST_ARC_LIT)
    while True:
        whole = count * 1.2 >= len(position)
        number = len(stages)
        stages.append(
            Stage(
                last_sample=last if whole else int(position[int(round(count)) - 1]),
                keep=10**9 if number == 0 else KEEP[min(number - 1, len(KEEP) - 1)],
                iterations=10 if number == 0 else 8,
                robust_scale=5.0,
                active=active[number] if number < len(active) else np.ones(len(names), bool),
            )
        )
        if whole:
            return stages
        count *= ARC_GROWTH


@eqx.filter_jit
def _first_guesses(problem: Problem, parameters: Parametrization, key, count: int, samples, max_rate):
    """`count` random starts and, in front of them, field-aligned ones for the first lit samples with their rates."""
    spacecraft, _ = build_model(jnp.asarray(parameters.nominal), jnp.asarray(parameters.reference_field))
    first = samples[0]
    measured = jnp.asarray(problem.measured)
    attitude, rate = random_starts(key, count, measured[first], problem.light.sun_eci[first], max_rate)

    def local(sample):
        light = jax.tree.map(lambda leaf: leaf[sample], problem.light)
        node = 2 * jnp.asarray(problem.grid.sample_index)[sample]
        field = problem.orbit.b_field_eci[node]
        return search_roll(measured[sample], field, spacecraft.panels, light, jnp.asarray(1.0))

    found = jax.vmap(local)(samples)
    times = jnp.asarray(problem.grid.node_times)[2 * jnp.asarray(problem.grid.sample_index)[samples]]
    turn = jax.vmap(
        lambda a: jax.vmap(
            lambda b: quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(a), b))
        )(found.quaternion[1])
    )(found.quaternion[0])
    local_rate = turn.reshape(-1, 3) / (times[1] - times[0])
    local_attitude = jnp.repeat(found.quaternion[0], found.quaternion.shape[1], axis=0)
    return jnp.concatenate([local_attitude, attitude]), jnp.concatenate([local_rate, rate])


def fit(
    observations: Observations, nominal: Nominal, settings: FitSettings, *, progress: Progress = lambda *_: None
) -> FitResult:
    """Best attitude motion and parameters of a session, with their uncertainty; a failure is a result, not an error.

    The arc starts at the first lit sample. Raises `InputError` where fewer than `FIRST_ARC_LIT` samples are lit.
    """
    began = time.perf_counter()
    progress("preparing", 0, 1)
    noise = 1e-3 * float(np.hypot(settings.noise_mA, settings.quantum_mA / np.sqrt(12.0)))
    observations = _from_first_light(observations, 3.0 * noise)
    duration = max(float(np.ptp(observations.t)), 1.0)
    max_rate = np.radians(settings.max_rate_deg_s)
    step = min(settings.step_s, rk4_step_for(max_rate, duration, COARSE_TOLERANCE))
    coarse = build_problem(observations, noise=noise, max_step=step)
    parameters = parametrization(nominal, settings.free, settings.prior)

    bright = observations.currents.max(axis=1) > 3.0 * noise
    lit = bright & (np.asarray(coarse.light.illumination)[: len(bright)] > 0.5)
    if lit.sum() < FIRST_ARC_LIT:
        raise InputError(
            f"only {lit.sum()} samples both outside the computed shadow and brighter than {3e3 * noise:.0f} mA; "
            f"a fit needs at least {FIRST_ARC_LIT}"
        )
    use = np.asarray(coarse.valid).astype(float)
    # A sample on the wrong side of a shadow edge by a second says nothing about attitude: leave it out.
    disagree = bright != (np.asarray(coarse.light.illumination)[: len(bright)] > 0.5)
    use[: len(bright)][disagree] = 0.0

    first_lit = np.flatnonzero(lit)[:2]
    attitude, rate = _first_guesses(
        coarse,
        parameters,
        jax.random.key(settings.seed),
        settings.starts,
        jnp.asarray(first_lit),
        jnp.asarray(max_rate),
    )
    x = np.zeros((len(attitude), len(parameters.names)))
    x[:, 3:6] = np.asarray(rate) / RATE_UNIT
    starts = Starts(x, np.asarray(attitude), np.zeros(len(x)))
    prepared = time.perf_counter()

    schedule = arc_schedule(lit, len(observations.t) - 1, settings.free)
    survivors = grow(coarse, parameters, schedule, starts, use, progress)
    # The spin of the survivors, with room for the swing of the magnet in the field.
    fastest = RATE_UNIT * float(np.linalg.norm(survivors.x[:8, 3:6], axis=1).max())
    step = min(settings.step_s, rk4_step_for(1.3 * fastest + 1e-3, duration, FINE_TOLERANCE))
    fine = build_problem(observations, noise=noise, max_step=step)
    refined = refine(fine, parameters, survivors, use, limiting=settings.limiting, progress=progress)
    result = summarize(observations.t, fine, parameters, refined)
    timing = {"prepare": prepared - began, "solve": time.perf_counter() - prepared}
    return dataclasses.replace(result, timing_s=timing)


def _from_first_light(observations: Observations, brightness: float) -> Observations:
    """The arc from its first bright sample on: the state is that at the arc's first sample, which must say something."""
    bright = np.flatnonzero(observations.currents.max(axis=1) > brightness)
    first = int(bright[0]) if len(bright) else 0
    return dataclasses.replace(
        observations,
        t=observations.t[first:],
        currents=observations.currents[first:],
        sun_eci=observations.sun_eci[first:],
    )
