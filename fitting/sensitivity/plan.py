"""A session that has not been flown: orbit, date, length, sampling and start, from which derivatives can be taken."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fitting.measurements.assembly import Samples, build_problem
from fitting.measurements.groups import over_columns
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.sensitivity.vantage import Vantage
from fitting.surroundings import around_of
from jaxsat.errors import InputError
from jaxsat.integrators import RK4, step_for
from jaxsat.satellites import Satellite
from jaxsat.synthetic.twins import TwinSettings
from jaxsat.synthetic.twins.source import epoch_of, with_orbit
from jaxsat.synthetic.twins.twin import start_of
from jaxsat.telemetry.table.motion import orbital_motion
from jaxsat.telemetry.table.orbit import MARGIN_S, orbit_over
from jaxsat.telemetry.table.session import Channel
from jaxsat.time import Epoch

LONGEST_STEP_S, TOLERANCE = 32.0, 2e-4
"""Integration step at most, and its error over the session [rad]: those of the last steps of a fit."""
FASTER = 1.25
"""Times the rate at the start, beyond which the motion on the way wants shorter steps."""

Columns = Mapping[str, tuple[np.ndarray, np.ndarray]]


def vantage_of_plan(
    satellite: Satellite,
    plan: TwinSettings | None = None,
    *,
    orbit: Path | None = None,
    columns: Columns | None = None,
    sun: np.ndarray | None = None,
) -> Vantage:
    """The nominal satellite along the motion of a plan, each channel read without noise at its interval.

    `plan` is as for `jaxsat simulate`: instant, length and interval, attitude and rate at the start (drawn by its seed
    where they are not given). `orbit` is a file in place of the orbit of the satellite file, `columns` what coils and
    wheels are commanded (times [s] and SI values; else zero), `sun` a unit vector to the Sun in place of the true one.
    Raises `InputError` where the orbit does not reach or the motion is one that only a table tells.
    """
    plan = plan or TwinSettings()
    flown = satellite if orbit is None else with_orbit(satellite, orbit)
    if satellite.motion.kind not in ("free", "orbital"):
        reason = "the motion is that of a table: name the directory of a fit in place of the satellite file"
        raise InputError(reason, file=satellite.path, field="motion.kind")
    epoch = epoch_of(flown, plan)
    around = around_at(flown, epoch, plan.duration_s, sun)
    given = None
    if satellite.motion.kind == "orbital":
        given = orbital_motion(around.orbit, start=-MARGIN_S, stop=plan.duration_s + MARGIN_S)
    samples = planned_samples(satellite, plan, epoch, columns or {}, given)
    # As `jaxsat simulate --nominal` draws them.
    attitude, rate = start_of(plan, np.random.default_rng(plan.seed))
    step = step_of(float(np.linalg.norm(rate)), samples.t)
    found = _along(satellite, samples, around, step, attitude, rate)
    # Torques may have spun it up on the way.
    fastest = float(np.linalg.norm(found.slopes.angular_velocity, axis=1).max())
    if given is None and fastest > FASTER * float(np.linalg.norm(rate)) and step_of(fastest, samples.t) < 0.8 * step:
        found = _along(satellite, samples, around, step_of(fastest, samples.t), attitude, rate)
    return found.as_read(found.slopes)


def step_of(rate: float, t: np.ndarray, tolerance: float = TOLERANCE) -> float:
    """Integration step [s] for a motion of this rate [rad/s] over times [s], for an error of `tolerance` [rad]."""
    span = max(float(np.ptp(t)), 1.0)
    return min(LONGEST_STEP_S, step_for(RK4, 1.3 * rate + 1e-3, span, tolerance))


def around_at(satellite: Satellite, epoch: Epoch, duration_s: float, sun: np.ndarray | None = None) -> Around:
    """What surrounds a satellite on its orbit from an instant on."""
    orbit = orbit_over(satellite, epoch, -MARGIN_S, duration_s + MARGIN_S)
    return around_of(satellite, orbit, epoch, sun=sun)


def planned_samples(
    satellite: Satellite,
    plan: TwinSettings,
    epoch: Epoch,
    columns: Columns,
    given: tuple[np.ndarray, np.ndarray] | None = None,
) -> Samples:
    """The channels at their intervals with ones in place of readings."""
    unknown = next((name for name in columns if name not in satellite.columns), None)
    if unknown is not None:
        known = ", ".join(satellite.columns) or "none"
        raise InputError(f"no column of a coil, a wheel or a stray current; there are {known}", field=unknown)
    channels = {}
    for name, settings in satellite.channels.items():
        every = settings.interval_s or plan.every_s
        t = np.round(every * np.arange(int(plan.duration_s / every * (1.0 + 1e-12)) + 1), 9)
        channels[name] = Channel.of(name, settings, t, np.ones((len(t), len(settings.columns))))
    zero = (np.zeros(1), np.zeros(1))
    return Samples.of(channels, epoch, {name: columns.get(name, zero) for name in satellite.columns}, given)


def planned_weight(problem: Problem, samples: Samples) -> np.ndarray:
    """[padded samples, channels] 1 where a reading counts: not of witnesses, and of light not in the penumbra."""
    weight = np.asarray(problem.known, float) * np.asarray(problem.valid)[:, None]
    witness = np.array([samples.channels[group.name].witness for group in problem.groups])
    weight[:, over_columns(witness, problem.groups)] = 0.0
    if problem.sky.light is not None:
        share = np.asarray(problem.sky.light.illumination)
        light = np.array([problem.model.sensors[group.name].sees == "sun" for group in problem.groups])
        doubtful = ((share > 0.0) & (share < 1.0))[:, None] & light
        weight = np.where(over_columns(doubtful, problem.groups), 0.0, weight)
    return weight


def _along(
    satellite: Satellite, samples: Samples, around: Around, step: float, attitude: np.ndarray, rate: np.ndarray
) -> Vantage:
    # Stamps of every channel may be late, so that each delay can be asked for.
    delayed = tuple(samples.channels)
    problem = build_problem(samples, satellite.model, around, delayed=delayed, max_step=step, room_for=step)
    return Vantage(satellite, satellite.model, problem, samples, attitude, rate, planned_weight(problem, samples))
