"""The main job for any satellite from Python: a table of telemetry and a satellite in, attitude and verdict out."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import jax
import numpy as np

from fitting.identify import Identified
from fitting.measurements.assembly import build_problem
from fitting.measurements.groups import columns_of
from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit
from fitting.outcome.looking import Look, look_at
from fitting.outcome.result import FitResult
from fitting.outcome.uncertainty import at_bound, covariance
from fitting.profile.profile import Profile
from fitting.report.fit.drawing import Draw, draw_all
from fitting.report.fit.owned import owned_files
from fitting.report.fit.surroundings import Surroundings
from fitting.settings import FitSettings
from fitting.solvers.least_squares import prior_information
from jaxsat.files.staging import staged_directory
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession


@dataclass(frozen=True)
class Fit:
    """The fit of one table: its result, and all that its report is made of."""

    result: FitResult
    found: Identified
    session: TableSession
    satellite: Satellite
    settings: FitSettings
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
        """In a word or two: see `fitting.outcome.result`."""
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
        moves, prior = free & ~pressed, prior_information(len(free))
        return covariance(np.asarray(point.hessian[0]), moves, prior)[np.ix_(free, free)]

    def _unknowns(self):
        return zip(self.found.parameters.names, self.found.parameters.everything, strict=True)

    def after(self, before_s: Mapping[str, float], *, total: float) -> "Fit":
        """The same with the seconds of what came before the fit in front of its own, and with the `total` [s]."""
        own = self.result.timing_s
        prepare = before_s.get("prepare", 0.0) + own.get("prepare", 0.0)
        timing = {**before_s, **own, "prepare": prepare, "total": total}
        return dataclasses.replace(self, result=dataclasses.replace(self.result, timing_s=timing))

    def motion(self, times: np.ndarray | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Attitudes [time 4], inertial from body, and rates [time 3, rad/s] at rising `times` [s] after the epoch.

        Raises ValueError for times before the first sample, and beyond a minute after the last one: there is no orbit.
        """
        seen = self.looked(times)
        return seen.quaternion, seen.angular_velocity

    def predict(self, channel: str, times: np.ndarray | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Noise-free readings of a channel at rising `times` [s] in its unit, and their 1-sigma without noise.

        Raises ValueError for times as `motion` does, KeyError for an unknown channel.
        """
        measured, groups = self.found.samples.channels[channel], self.found.minima[0].problem.groups
        own = next(columns for group, columns in zip(groups, columns_of(groups), strict=True) if group.name == channel)
        seen = self.looked(times)
        spread = np.sqrt(np.maximum(seen.promised[:, own] ** 2 - 1.0, 0.0)) * measured.sigma
        return seen.readings[channel] * measured.to_unit, spread * measured.to_unit

    def looked(self, times: np.ndarray | Sequence[float]) -> Look:
        """The best minimum at other rising times; raises ValueError as `motion` does."""
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
        problem = build_problem(samples, best.problem.model, self.around, whole=old, **room)
        point = jax.tree.map(lambda leaf: np.asarray(leaf)[0], best.refined.points)
        return look_at(problem, self.found.parameters, point).at(np.arange(ahead, len(t)))

    def write(self, directory: str | Path, *, plots: bool = True) -> list[str]:
        """Writes the files of `jaxsat fit` into a directory, whole or not at all; returns warnings.

        Only files of these names are replaced in a directory that exists. Raises `InputError` where it cannot be
        written.
        """
        directory = Path(directory)
        with staged_directory(directory, owned_files(directory, self.result.channels)) as stage:
            return self.write_into(stage, draw=draw_all if plots else None)

    def write_into(self, stage: Path, *, draw: Draw | None) -> list[str]:
        """Writes the same into an empty directory, with pictures by `draw` if any; returns warnings."""
        # What makes pages is wanted here for the first time.
        from fitting.report.between import between_samples
        from fitting.report.fit.files import write_fit

        return write_fit(
            stage,
            replace(self.result, between=between_samples(self.result, self.found, self.around, self.looked)),
            telemetry=self.session.telemetry,
            label=self.session.name,
            epoch=self.session.epoch,
            session=self.session,
            settings=self.settings.model_dump(mode="json"),
            draw=draw,
            surroundings=self.surroundings(),
            orbit_fit=self.orbit_fit,
            satellite=self.satellite,
            profiles=self.profiles,
            remarks=self.profile_remarks,
        )
