"""The main job for any satellite from Python: a table of telemetry and a satellite in, attitude and verdict out."""

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

import jax
import numpy as np

from fitting.identify import Identified, identify
from fitting.measurements.assembly import Samples, build_sensed, channels_within
from fitting.measurements.enough import check_light
from fitting.measurements.given import is_told
from fitting.measurements.groups import columns_of
from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit
from fitting.outcome.looking import Look, look_at
from fitting.outcome.sensed_result import SensedResult
from fitting.outcome.sensed_summary import summarize_sensed
from fitting.outcome.uncertainty import at_bound, covariance
from fitting.parameters.free import free_parameters
from fitting.profile.profile import Profile
from fitting.profile.profiler import Profiler
from fitting.report.sensed.owned import owned_files
from fitting.report.sensed.surroundings import Surroundings, look_around
from fitting.sensed_settings import SensedSettings
from fitting.starts.multi_start import Progress
from fitting.surroundings import surroundings
from jaxsat.errors import InputError
from jaxsat.files.staging import staged_directory
from jaxsat.given import Given
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import Leaf
from jaxsat.telemetry import TableSession
from jaxsat.telemetry.table.motion import motion_for


@dataclass(frozen=True)
class SensedFit:
    """The fit of one table: its result, and all that its report is made of."""

    result: SensedResult
    found: Identified
    session: TableSession
    satellite: Satellite
    settings: SensedSettings
    around: Around
    orbit_fit: OrbitFit | None
    """Where the orbit was fitted to positions of the table, or given in their place."""
    surroundings: Callable[[], Surroundings]
    """What the motion happens in; waits where it is still being computed."""
    profiles: tuple[Profile, ...] = ()
    """Of the parameters that were asked for."""
    profile_remarks: tuple[str, ...] = ()
    """Why others of them are missing."""

    @property
    def status(self) -> str:
        """`converged`, `not_converged` or `ambiguous`."""
        return self.result.status

    @property
    def verdict(self) -> str:
        """In a word or two: see `fitting.outcome.sensed_result`."""
        return self.result.verdict

    @property
    def names(self) -> tuple[str, ...]:
        """Of the unknowns that were fitted, in the order of `covariance`."""
        return tuple(name for name, free in self._unknowns() if free)

    @property
    def covariance(self) -> np.ndarray:
        """Of the unknowns: small turn of the start in body axes [rad], rate [rad/min], leaves in their prior sigmas."""
        free = np.array([free for _, free in self._unknowns()])
        point = self.found.minima[0].refined.points
        pressed = at_bound(np.asarray(point.x)[0], np.asarray(point.gradient)[0], self.found.parameters.bounds())
        return covariance(np.asarray(point.hessian[0]), free & ~pressed)[np.ix_(free, free)]

    def _unknowns(self):
        return zip(self.found.parameters.names, self.found.parameters.everything, strict=True)

    def after(self, before_s: Mapping[str, float], *, total: float) -> "SensedFit":
        """The same with the seconds of what came before the fit in front of its own, and with the `total` [s]."""
        own = self.result.timing_s
        prepare = before_s.get("prepare", 0.0) + own.get("prepare", 0.0)
        timing = {**before_s, **own, "prepare": prepare, "total": total}
        return dataclasses.replace(self, result=dataclasses.replace(self.result, timing_s=timing))

    def motion(self, times: np.ndarray | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Attitudes [time 4], inertial from body, and rates [time 3, rad/s] at rising `times` [s] after the epoch.

        Raises ValueError for times before the first sample, and beyond a minute after the last one: there is no orbit.
        """
        seen = self._looked(times)
        return seen.quaternion, seen.angular_velocity

    def predict(self, channel: str, times: np.ndarray | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings of a channel at rising `times` [s] in its unit, and their 1-sigma without noise.

        Raises ValueError for times as `motion` does, KeyError for an unknown channel.
        """
        measured, groups = self.found.samples.channels[channel], self.found.minima[0].problem.groups
        own = next(columns for group, columns in zip(groups, columns_of(groups), strict=True) if group.name == channel)
        seen = self._looked(times)
        spread = np.sqrt(np.maximum(seen.promised[:, own] ** 2 - 1.0, 0.0)) * measured.sigma
        return seen.readings[channel] * measured.to_unit, spread * measured.to_unit

    def _looked(self, times: np.ndarray | Sequence[float]) -> Look:
        """The best minimum at other times."""
        old, best = self.found.samples, self.found.minima[0]
        times = np.asarray(times, float)
        if not (np.all(np.diff(times) > 0.0) and times[0] >= old.t[0]):
            raise ValueError(f"times must rise from {old.t[0]:g} s, the first sample, on")
        self.around.orbit.check_span(times)
        ahead = int(times[0] > old.t[0])
        t = np.concatenate([old.t[:ahead], times])
        # In the shape of the session, where they have room in it: the program is there already.
        values = {name: np.zeros((len(t), rows.shape[1])) for name, rows in old.values.items()}
        step = float(np.max(np.asarray(best.problem.grid.step), initial=0.0)) or self.settings.step_s
        room = {"delayed": best.problem.delayed, "max_step": step, "room_for": self.found.finest_step}
        samples = replace(old, t=t, values=values)
        problem = build_sensed(samples, best.problem.model, self.around, whole=old, **room)
        point = jax.tree.map(lambda leaf: np.asarray(leaf)[0], best.refined.points)
        return look_at(problem, self.found.parameters, point).at(np.arange(ahead, len(t)))

    def write(self, directory: str | Path, *, plots: bool = True) -> list[str]:
        """Writes the files of `jaxsat fit` into a directory, whole or not at all; returns warnings.

        Only files of these names are replaced in a directory that exists. Raises `InputError` where it cannot be
        written.
        """
        directory = Path(directory)
        with staged_directory(directory, owned_files(directory, self.result.channels)) as stage:
            return self.write_into(stage, plots=plots)

    def write_into(self, stage: Path, *, plots: bool = True) -> list[str]:
        """Writes the same into an empty directory; returns warnings."""
        # Matplotlib is wanted here for the first time.
        from fitting.report.sensed.files import write_sensed

        return write_sensed(
            stage,
            self.result,
            telemetry=self.session.telemetry,
            label=self.session.name,
            epoch=self.session.epoch,
            session=self.session,
            settings=self.settings.model_dump(mode="json"),
            plots=plots,
            surroundings=self.surroundings(),
            orbit_fit=self.orbit_fit,
            satellite=self.satellite,
            profiles=self.profiles,
            remarks=self.profile_remarks,
        )


def chosen_leaves(
    leaves: Sequence[Leaf], free: Sequence[str] | None, aliases: Mapping[str, Sequence[str]] | None = None
) -> tuple[str, ...]:
    """Names of the free leaves; raises `InputError` naming the first item that is none, with a suggestion.

    An alias may be written in capitals or not.
    """
    if free is None:
        return tuple(leaf.name for leaf in leaves if leaf.sigma is not None)
    names = [leaf.name for leaf in leaves]
    prefixes = {".".join(name.split(".")[:k]) for name in names for k in range(1, name.count(".") + 2)}
    # What says the same in another way is asked for by its own name.
    below = [leaf.name for leaf in leaves if not leaf.restates]
    chosen: set[str] = set()
    for item in (part.strip() for part in free):
        for each in [item] if item in prefixes else spelt_out(item, aliases or {}):
            found = [name for name in names if name == each or (name in below and name.startswith(f"{each}."))]
            if not found and each != "state":
                close = get_close_matches(each, sorted(prefixes), n=1)
                heads = ", ".join(dict.fromkeys(["state", *(name.split(".")[0] for name in below)]))
                hint = f"did you mean {close[0]}?" if close else f"expected any of {heads}, or what is below them"
                raise InputError(f"unknown free parameter {each!r}; {hint}", field="free")
            chosen.update(found)
    return tuple(name for name in names if name in chosen)


def spelt_out(item: str, aliases: Mapping[str, Sequence[str]]) -> Sequence[str]:
    """What an alias stands for, in capitals or not, also where it begins a longer name, as gains in gains.+x."""
    meant = {name.casefold(): names for name, names in aliases.items()}
    if item.casefold() in meant:
        return meant[item.casefold()]
    head, dot, tail = item.partition(".")
    return [f"{each}.{tail}" for each in meant[head.casefold()]] if dot and head.casefold() in meant else [item]


def fit_table(
    satellite: Satellite,
    session: TableSession,
    settings: SensedSettings | None = None,
    *,
    given: Given | None = None,
    profiles: Sequence[str] = (),
    progress: Progress = lambda *_: None,
    sky_ahead: bool = False,
) -> SensedFit:
    """Fits motion, satellite and sensors to all channels of a session.

    `given` is what of orbit, Earth and Sun shall not be found from session and satellite, `profiles` names free
    parameters whose cost is walked along; with `sky_ahead` what a report shows of the surroundings is computed beside
    the fit. Raises `InputError` for what cannot be fitted and for such names that are not free, ValueError where JAX
    works in single precision.
    """
    if not jax.config.read("jax_enable_x64"):
        raise ValueError("a fit works in 64-bit numbers and JAX in 32-bit ones: call jaxsat.set_up_jax() first")
    settings = settings or SensedSettings()
    began = time.perf_counter()
    if given is not None and given.time.zero_s:
        session = session.with_time_zero(given.time.zero_s)
    model, leaves, kind = satellite.model, satellite.leaves, satellite.motion.kind
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
    sky = look_around(samples.t, around, session.epoch, at_once=sky_ahead)
    late = {leaf.place for leaf in leaves if leaf.name in free or leaf.sigma is not None}
    delayed = tuple(
        name for name in channels if f"delays.{name}" in late or float(np.asarray(model.delays[name])) != 0.0
    )
    parameters = free_parameters(model, leaves, free, free_motion=kind == "free", held=satellite.held)
    asked = [each for name in profiles for each in spelt_out(name, satellite.aliases)]
    profiler = Profiler(asked, parameters, settings.likelihood, progress)
    begin, end = float(samples.t[0]), float(samples.t[-1])
    fitted = [name for name, channel in channels.items() if not channel.witness]
    if not fitted:
        raise InputError("no channel that is fitted has a reading in the table", file=session.paths[0])
    unknown = {name: each for name, each in satellite.conventions.items() if name in fitted}
    prepared = time.perf_counter() - began
    try:
        found = identify(
            samples,
            model,
            around,
            parameters,
            settings,
            unknown_axes=unknown,
            fit_until=end - settings.holdout * (end - begin),
            delayed=delayed,
            progress=progress,
        )
    except InputError as error:
        raise InputError(error.reason, file=error.file or session.paths[0], field=error.field) from None
    result = summarize_sensed(found)
    profiler(found)
    timing = {**result.timing_s, "prepare": result.timing_s["prepare"] + prepared}
    timing["total"] = time.perf_counter() - began
    result = dataclasses.replace(result, timing_s=timing, remarks=(*remarks, *result.remarks))
    taken = profiler.profiles, profiler.reasons
    return SensedFit(result, found, session, satellite, settings, around, orbit_fit, sky, *taken)


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
