"""The main job for any satellite from Python: a table of telemetry and a satellite in, attitude and verdict out."""

import dataclasses
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

import jax
import numpy as np

from fitting.identify import Identified, Search, identify
from fitting.measurements.assembly import Samples, build_sensed
from fitting.measurements.sky import Around
from fitting.outcome.looking import look_at
from fitting.outcome.sensed_result import SensedResult
from fitting.outcome.sensed_summary import summarize_sensed
from fitting.outcome.uncertainty import at_bound, covariance
from fitting.parameters.free import free_parameters
from fitting.report.sensed.files import owned_files, write_sensed
from fitting.sensed_settings import SensedSettings
from fitting.starts.multi_start import Progress
from jaxsat.constants import EARTH_RADIUS_MEAN, EARTH_ROTATION_RATE
from jaxsat.environment import igrf_field
from jaxsat.errors import InputError
from jaxsat.files.staging import staged_directory
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import Leaf
from jaxsat.telemetry import TableSession
from jaxsat.telemetry.table.motion import motion_for
from jaxsat.telemetry.table.orbit import orbit_for
from jaxsat.time import greenwich_angle


@dataclass(frozen=True)
class SensedFit:
    """The fit of one table: its result, and all that its report is made of."""

    result: SensedResult
    found: Identified
    session: TableSession
    satellite: Satellite
    settings: SensedSettings

    around: Around

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

    def motion(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Attitudes [time 4], inertial from body, and rates [time 3, rad/s] at rising `times` [s] after the epoch.

        Raises ValueError for times before the first sample.
        """
        _, seen = self._looked(times, None)
        return seen.quaternion, seen.angular_velocity

    def predict(self, channel: str, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings of a channel at rising `times` [s] in its unit, and their 1-sigma without noise.

        Raises ValueError for times before the first sample, KeyError for an unknown channel.
        """
        measured = self.found.samples.channels[channel]
        samples, seen = self._looked(times, channel)
        readings = seen.readings[channel] * measured.to_unit
        spread = np.sqrt(np.maximum(seen.promised**2 - 1.0, 0.0)) * samples.channels[channel].sigma * measured.to_unit
        return readings, spread

    def _looked(self, times, channel):
        """The best minimum at other times."""
        old, best = self.found.samples, self.found.minima[0]
        times = np.asarray(times, float)
        if not np.all(np.diff(times) > 0.0) or not times[0] >= old.t[0]:
            raise ValueError(f"times must rise from {old.t[0]:g} s, the first sample, on")
        ahead = int(times[0] > old.t[0])
        t = np.concatenate([old.t[:ahead], times])
        name = channel or next(iter(old.channels))
        values = {name: np.zeros((len(t), old.values[name].shape[1]))}
        samples = replace(old, t=t, values=values, channels={name: old.channels[name]})
        step = float(np.max(np.asarray(best.problem.grid.step), initial=0.0)) or self.settings.step_s
        problem = build_sensed(
            samples, best.problem.model, self.around, delayed=best.problem.delayed, max_step=step, room_for=step
        )
        point = jax.tree.map(lambda leaf: np.asarray(leaf)[0], best.refined.points)
        seen = look_at(problem, self.found.parameters, point)
        return samples, seen.at(np.arange(ahead, len(t)))

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
        return write_sensed(
            stage,
            self.result,
            telemetry=", ".join(str(path) for path in self.session.paths),
            label=self.session.name,
            epoch=self.session.epoch,
            session=self.session,
            settings=self.settings.model_dump(mode="json"),
            plots=plots,
            around=self.around,
            name=self.satellite.name,
            size_m=self.satellite.size_m,
        )


def chosen_leaves(leaves: Sequence[Leaf], free: Sequence[str] | None, aliases: dict | None = None) -> tuple[str, ...]:
    """Names of the free leaves; raises `InputError` naming the first item that is none, with a suggestion."""
    if free is None:
        return tuple(leaf.name for leaf in leaves if leaf.sigma is not None)
    names = [leaf.name for leaf in leaves]
    prefixes = {".".join(name.split(".")[:k]) for name in names for k in range(1, name.count(".") + 2)}
    chosen: set[str] = set()
    for item in (part.strip() for part in free):
        expanded = (aliases or {}).get(item, [item])
        for each in expanded:
            found = [name for name in names if name == each or name.startswith(f"{each}.")]
            if not found and each != "state":
                close = get_close_matches(each, sorted(prefixes), n=1)
                hint = f"; did you mean {close[0]}?" if close else ""
                raise InputError(f"unknown free parameter {each!r}{hint}", field="free")
            chosen.update(found)
    return tuple(name for name in names if name in chosen)


def fit_table(
    satellite: Satellite,
    session: TableSession,
    settings: SensedSettings | None = None,
    *,
    progress: Progress = lambda *_: None,
) -> SensedFit:
    """Fits motion, satellite and sensors to all channels of a session.

    Raises `InputError` for what cannot be fitted, ValueError where JAX works in single precision.
    """
    if not jax.config.read("jax_enable_x64"):
        raise ValueError("a fit works in 64-bit numbers and JAX in 32-bit ones: call jaxsat.set_up_jax() first")
    settings = settings or SensedSettings()
    began = time.perf_counter()
    model, leaves, kind = satellite.model, satellite.leaves, satellite.motion.kind
    free = chosen_leaves(leaves, settings.free, dict(satellite.aliases))
    channels = {name: channel for name, channel in session.channels.items() if np.isfinite(channel.values).any()}
    if settings.arc_s is not None:
        channels = {name: _within(channel, settings.arc_s) for name, channel in channels.items()}
    if not channels:
        raise InputError("no channel of the satellite file has a reading in the table", file=session.paths[0])
    around = surroundings(satellite, session)
    given = motion_for(satellite, session, around.orbit)
    samples = Samples.of(channels, session.epoch, dict(session.columns), given)
    late = {leaf.place for leaf in leaves if leaf.name in free or leaf.sigma is not None}
    delayed = tuple(
        name for name in channels if f"delays.{name}" in late or float(np.asarray(model.delays[name])) != 0.0
    )
    parameters = free_parameters(model, leaves, free, free_motion=kind == "free")
    begin, end = float(samples.t[0]), float(samples.t[-1])
    search = Search(
        starts=settings.starts,
        seed=settings.seed,
        max_rate=float(np.radians(settings.max_rate_deg_s)),
        longest_step=settings.step_s,
        likelihood=settings.likelihood,
    )
    unknown = {name: each for name, each in satellite.conventions.items() if name in channels}
    prepared = time.perf_counter() - began
    try:
        found = identify(
            samples,
            model,
            around,
            parameters,
            search,
            unknown_axes=unknown,
            fit_until=end - settings.holdout * (end - begin),
            delayed=delayed,
            progress=progress,
        )
    except InputError as error:
        raise InputError(error.reason, file=error.file or session.paths[0], field=error.field) from None
    result = summarize_sensed(found)
    timing = {**result.timing_s, "prepare": result.timing_s["prepare"] + prepared}
    timing["total"] = time.perf_counter() - began
    return SensedFit(dataclasses.replace(result, timing_s=timing), found, session, satellite, settings, around)


def surroundings(satellite: Satellite, session: TableSession) -> Around:
    """Orbit, field and Earth of a session."""
    craft = satellite.model.spacecraft
    return Around(
        orbit_for(satellite, session),
        igrf_field(session.epoch.decimal_year()),
        np.asarray(greenwich_angle(session.epoch)),
        np.asarray(EARTH_ROTATION_RATE),
        np.asarray(EARTH_RADIUS_MEAN),
        field_rate=craft.hysteresis_rods is not None,
        pushed=craft.facets is not None,
    )


def _within(channel, arc_s):
    inside = (channel.t_s >= arc_s[0]) & (channel.t_s <= arc_s[1])
    return replace(channel, t_s=channel.t_s[inside], values=channel.values[inside])
