"""The main job from Python: telemetry in, attitude, parameters and a verdict out, written as by `jaxsat fit`."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.examine import DENIED, doubtful, examine, reconsidered
from fitting.fitted import Fit
from fitting.identify import Identified, identify
from fitting.measurements.assembly import Samples, channels_within
from fitting.measurements.enough import check_light
from fitting.measurements.given import is_told
from fitting.measurements.sky import Around
from fitting.measurements.units import turns_between
from fitting.orbit.orbit_fit import OrbitFit
from fitting.outcome.summary import summarize
from fitting.outcome.verdict import Background
from fitting.parameters.chosen import chosen_leaves, spelt_out
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.opposed import OPPOSED, direction_alone, is_opposed, turned_round
from fitting.profile.profiler import Profiler
from fitting.report.fit.surroundings import Surroundings, look_around
from fitting.settings import FitSettings
from fitting.starts.guess import Guess, check_names
from fitting.starts.multi_start import Progress
from fitting.surroundings import surroundings
from jaxsat.errors import InputError
from jaxsat.given import Given
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import Leaf
from jaxsat.telemetry import TableSession
from jaxsat.telemetry.table.as_if import taken_as
from jaxsat.telemetry.table.motion import motion_for
from jaxsat.time import SECONDS_PER_DAY


def fit(
    satellite: Satellite,
    session: TableSession,
    *,
    free: str | Sequence[str] | None = None,
    holdout: float | None = None,
    settings: FitSettings | None = None,
    given: Given | None = None,
    profiles: Sequence[str] = (),
    guess: Guess | None = None,
    progress: Progress = lambda *_: None,
    sky_ahead: bool = False,
    causes: bool = True,
    as_if: Sequence[str] = (),
) -> Fit:
    """Fits attitude and parameters to what the sensors of a satellite measured.

    `satellite` (`jaxsat.read_satellite`) holds the nominal values and the sensors, `session` (`jaxsat.read_telemetry`)
    the telemetry. `free` names what is fitted and `holdout` the share of the time that is only predicted, in place of
    those of `settings`; `given` is what of orbit, Earth and Sun shall not be found from session and satellite;
    `profiles` names free parameters whose cost is walked along; from a `guess` (`fitting.read_guess`, or one's own) the
    fit goes on without a search, and says so; with `sky_ahead` what a report shows of the
    surroundings is computed beside the fit; with `causes` the usual ones are tried where the data deny
    it or chi2 is doubtful (half a minute or more), and what explains a doubt denies it too; `as_if` are changes of the
    data as a cause offers them, such as `swapped:+X,-X` (see `jaxsat.telemetry.table.as_if`). A fit that does not
    converge is a result with that status. Raises `InputError` for what cannot be fitted and for names not free,
    ValueError (pydantic's) for a setting or a change that cannot be, and where JAX works in single precision.
    """
    if not jax.config.read("jax_enable_x64"):
        raise ValueError("a fit works in 64-bit numbers and JAX in 32-bit ones: call jaxsat.set_up_jax() first")
    settings = settings or FitSettings()
    if free is not None:
        settings = settings.changed(free=free)
    if holdout is not None:
        settings = settings.changed(holdout=holdout)
    if guess is not None:
        if satellite.motion.kind != "free":
            reason = "a motion that is given is not guessed: leave the guess, or set motion.kind = 'free'"
            raise InputError(reason, file=satellite.path, field="motion.kind")
        check_names(guess, satellite.leaves)
    began = time.perf_counter()
    if given is not None and given.time.zero_s:
        session = session.with_time_zero(given.time.zero_s)
    satellite, session = taken_as(as_if, satellite, session)
    task = _prepare(satellite, session, settings, given, sky_ahead)
    for remark in task.remarks:
        # Before the search, which may be long by what it tells.
        progress(remark, 0, 1)
    asked = [each for name in profiles for each in spelt_out(name, satellite.aliases)]
    profiler = Profiler(asked, task.parameters, settings.likelihood, progress)
    prepared = time.perf_counter() - began
    try:
        found, told = _identified(task, satellite, settings, guess, progress)
    except InputError as error:
        raise InputError(error.reason, file=error.file or session.paths[0], field=error.field) from None
    result = summarize(found, _background(session, task.orbit_fit))
    profiler(found)
    if causes:
        missed_m = None if task.orbit_fit is None else task.orbit_fit.rms_after_m
        bench = Bench(found, task.around, settings, task.delayed, satellite, session, given, missed_m)
        if result.verdict in DENIED:
            result = dataclasses.replace(result, causes=examine(bench, result, progress))
        elif doubtful(result):
            result = reconsidered(bench, result, progress)
    timing = {**result.timing_s, "prepare": result.timing_s["prepare"] + prepared}
    timing["total"] = time.perf_counter() - began
    begin = () if guess is None else (guess.remark,)
    begin += (f"the data are fitted as {', '.join(as_if)}",) if as_if else ()
    result = dataclasses.replace(result, timing_s=timing, remarks=(*begin, *task.remarks, *told, *result.remarks))
    about = session, satellite, settings, task.around, task.orbit_fit, task.sky
    return Fit(result, found, *about, profiler.profiles, profiler.reasons)


def _identified(
    task: "_Task", satellite: Satellite, settings: FitSettings, guess: Guess | None, progress: Progress
) -> tuple[Identified, tuple[str, ...]]:
    """The minima, and what is to be told of the way to them."""

    def about(parameters: FreeParameters) -> Identified:
        return identify(
            task.samples,
            satellite.model,
            task.around,
            parameters,
            settings,
            unknown_axes=task.unknown_axes,
            fit_until=task.fit_until,
            delayed=task.delayed,
            guess=guess,
            progress=progress,
        )

    found = about(task.parameters)
    best = [minimum.refined for minimum in found.minima[:1]]
    opposed = any(is_opposed(found.parameters, np.asarray(each.points.x)[0, len(STATE) :]) for each in best)
    # No step leads through no dipole: the starts that were on the way to the opposite one may all have ended there.
    lost = any(each.hopeless[0] for each in best) and direction_alone(found.parameters)
    if not (opposed or lost):
        return found, ()
    try:
        other = about(turned_round(task.parameters))
    except InputError:
        # No start about it survives; what was found stands.
        return found, (OPPOSED,) if opposed else ()
    least = other.minima[0].refined
    if least.score[0] < best[0].score[0] and not least.hopeless[0]:
        return other, (OPPOSED,)
    return found, (OPPOSED,) if opposed else ()


def _background(session: TableSession, orbit_fit: OrbitFit | None) -> Background:
    """What is known beside the readings."""
    missed = None if orbit_fit is None else orbit_fit.rms_after_m
    known = session.elements_epoch
    age = None if known is None else session.epoch.seconds_since(known) / SECONDS_PER_DAY
    return Background(missed, age)


@dataclass(frozen=True)
class _Task:
    """What is to be fitted to what."""

    samples: Samples
    around: Around
    orbit_fit: OrbitFit | None
    sky: Callable[[], Surroundings]
    parameters: FreeParameters
    unknown_axes: dict[str, str]
    fit_until: float
    """End of what is fitted [s]; what comes later is held out."""
    delayed: tuple[str, ...]
    """Channels that are or may be late."""
    remarks: tuple[str, ...]


def _prepare(
    satellite: Satellite, session: TableSession, settings: FitSettings, given: Given | None, sky_ahead: bool
) -> _Task:
    """Reads out of satellite, session and settings what is to be fitted; raises `InputError`."""
    model, leaves = satellite.model, satellite.leaves
    free = chosen_leaves(leaves, settings.free, satellite.aliases)
    if settings.free is None:
        free = tuple(leaf.name for leaf in leaves if leaf.name in free and not _of_witness(leaf, session))
    channels = channels_within(session, settings.arc_s)
    check_light(channels, model, session.paths[0])
    around, orbit_fit = surroundings(satellite, session, given)
    told = motion_for(satellite, session, around.orbit)
    remarks = ()
    if told is not None:
        channels, remarks = _where_told(channels, told, session)
    samples = Samples.of(channels, session.epoch, dict(session.columns), told)
    remarks += tuple(turns_between(samples, model))
    sky = look_around(samples.t, around, session.epoch, at_once=sky_ahead)
    late = {leaf.place for leaf in leaves if leaf.name in free or leaf.sigma is not None}
    delayed = tuple(
        name for name in channels if f"delays.{name}" in late or float(np.asarray(model.delays[name])) != 0.0
    )
    moves = satellite.motion.kind == "free"
    parameters = free_parameters(model, leaves, free, free_motion=moves, held=satellite.held)
    fitted = [name for name, channel in channels.items() if not channel.witness]
    if not fitted:
        raise InputError("no channel that is fitted has a reading in the table", file=session.paths[0])
    unknown = {name: each for name, each in satellite.conventions.items() if name in fitted}
    begin, end = float(samples.t[0]), float(samples.t[-1])
    until = end - settings.holdout * (end - begin)
    return _Task(samples, around, orbit_fit, sky, parameters, unknown, until, delayed, remarks)


def _of_witness(leaf: Leaf, session: TableSession) -> bool:
    """Whether it is a number of a sensor that is only asked whether it agrees."""
    return any(
        channel.witness and leaf.place.startswith((f"sensors.{name}.", f"delays.{name}"))
        for name, channel in session.channels.items()
    )


def _where_told(channels, told, session):
    """The channels while the given motion is told, and remarks on what is left out elsewhere."""
    found, remarks = {}, []
    for name, channel in channels.items():
        inside = is_told(told, channel.t_s)
        if not inside.all():
            left = f"{int((~inside).sum())} of {inside.size} samples of {name}"
            remarks.append(f"{left} stand where no two quaternions follow each other, and are not used")
        if inside.any():
            found[name] = replace(channel, t_s=channel.t_s[inside], values=channel.values[inside])
    if not found:
        raise InputError("no reading of any channel where the motion is given", file=session.paths[0])
    return found, tuple(remarks)
