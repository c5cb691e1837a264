"""The main job from Python: a session of telemetry in, attitude and parameters out, written as by `jaxsat fit`."""

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jax

from fitting.estimate import estimate
from fitting.measurements.limb_input import LimbInput
from fitting.measurements.observations import LIMB_FIELD
from fitting.outcome.diagnostics import magnetometer_witness
from fitting.outcome.result import FitResult, FittedParameter
from fitting.outcome.sensed_verdict import Witness
from fitting.parameters.nominal import nominal_model
from fitting.profile.profile import Profile
from fitting.report.files import FILES, write_fit
from fitting.report.scene import Sky, look_around
from fitting.sensed_run import SensedFit, fit_table
from fitting.sensed_settings import SensedSettings
from fitting.session import PreparedSession, prepare_session
from fitting.settings import FitSettings
from fitting.starts.multi_start import Progress
from jaxsat.errors import InputError
from jaxsat.files.staging import staged_directory
from jaxsat.given import Given
from jaxsat.satellites import Satellite, SatelliteNumbers
from jaxsat.telemetry import MatchedLimbAngles, Session, TableSession


@dataclass(frozen=True)
class SessionFit:
    """The fit of one session: its result, and all that its report is made of."""

    result: FitResult
    prepared: PreparedSession
    satellite: SatelliteNumbers
    settings: FitSettings
    sky: Callable[[], Sky]
    """What the motion happens in; waits where it is still being computed."""
    profiles: Sequence[Profile] = ()
    limb: MatchedLimbAngles | None = None
    """Limb angles that were fitted too."""
    witness: Witness | None = None
    """What the magnetometer says of the motion; None where it has no reading."""
    remarks: Sequence[str] = ()
    """Warnings of what was given and is not used, and of profiles that could not be taken."""

    @property
    def status(self) -> str:
        """`converged`, `not_converged` or `ambiguous`."""
        return self.result.status

    @property
    def message(self) -> str:
        """Why the status is what it is."""
        return self.result.message

    @property
    def parameters(self) -> tuple[FittedParameter, ...]:
        """All parameters of the model, the fitted and the fixed, in the units of their names."""
        return self.result.parameters

    def after(self, before_s: Mapping[str, float], **times: float) -> "SessionFit":
        """The same with the seconds of what came before the fit in front of its own."""
        own = self.result.timing_s
        prepare = before_s["prepare"] + own.get("prepare", 0.0)
        result = dataclasses.replace(self.result, timing_s={**before_s, **own, "prepare": prepare, **times})
        return dataclasses.replace(self, result=result)

    def write(self, directory: str | Path, *, plots: bool = True) -> list[str]:
        """Writes the files of `jaxsat fit` into a directory, whole or not at all; returns warnings.

        Only files of these names are replaced in a directory that exists. Raises `InputError` where it cannot be
        written.
        """
        with staged_directory(Path(directory), FILES) as stage:
            return self.write_into(stage, plots=plots)[1]

    def write_into(self, stage: Path, *, plots: bool = True, began: float | None = None) -> tuple[FitResult, list[str]]:
        """Writes the same into an empty directory; returns the result as it was written, and warnings.

        The total time is counted from `began` (perf_counter), or is that of the fit and of the writing.
        """
        known = self.result.timing_s.get("total", 0.0)
        return write_fit(
            stage,
            self.result,
            self.prepared,
            self.satellite,
            self.settings,
            sky=self.sky(),
            began=time.perf_counter() - known if began is None else began,
            plots=plots,
            profiles=self.profiles,
            limb=self.limb,
            witness=self.witness,
            remarks=self.remarks,
        )


def fit(
    satellite: SatelliteNumbers | Satellite,
    session: Session | TableSession,
    *,
    free: str | Sequence[str] | None = None,
    holdout: float | None = None,
    settings: FitSettings | SensedSettings | None = None,
    given: Given | None = None,
    limb: str | Path | None = None,
    profiles: Sequence[str] = (),
    progress: Progress = lambda *_: None,
) -> SessionFit | SensedFit:
    """Fits attitude and parameters to what the sensors of a satellite measured.

    `satellite` (`jaxsat.read_satellite`) holds the nominal values, `session` (`jaxsat.read_telemetry`) the telemetry: a
    satellite file of any sensors and its tables are fitted by `fit_table`, of which the share `holdout` of the time is
    only predicted; a satellite of Munin's kind and a RAW_SUN session by its six panel currents, with what follows.
    `free` names what is fitted, in place of `settings.free`; `given` is what of orbit, Earth and Sun shall not be found
    from the session; `limb` a CSV file of limb angles; `profiles` names free parameters whose cost is walked along.
    A fit that does not converge is a result with that status. Raises `InputError` for what cannot be fitted, ValueError
    (pydantic's) for a setting that cannot be, and ValueError where JAX works in single precision.
    """
    if isinstance(satellite, Satellite) and isinstance(session, TableSession):
        return _fit_table(satellite, session, free, holdout, settings, profiles, progress, given or limb)
    if isinstance(satellite, Satellite) or isinstance(session, TableSession) or isinstance(settings, SensedSettings):
        raise ValueError("fit: a table goes with a satellite file of sensors, a RAW_SUN session with Munin's numbers")
    if holdout is not None:
        raise ValueError("fit: holdout belongs to tables and a satellite file of sensors")
    settings = settings or FitSettings()
    if free is not None:
        settings = settings.changed(free=free)
    began = time.perf_counter()
    prepared = prepare_session(session, given)
    prepare_s = time.perf_counter() - began
    found = fit_prepared(
        prepared, satellite, settings, limb=None if limb is None else Path(limb), profiles=profiles, progress=progress
    )
    return found.after({"prepare": prepare_s}, total=time.perf_counter() - began)


def _fit_table(satellite, session, free, holdout, settings, profiles, progress, further) -> SensedFit:
    if further or isinstance(settings, FitSettings):
        raise ValueError("fit: given, limb and FitSettings belong to sessions of Munin's kind")
    settings = settings or SensedSettings()
    if free is not None:
        settings = settings.changed(free=tuple(free.split(",") if isinstance(free, str) else free))
    if holdout is not None:
        settings = settings.changed(holdout=holdout)
    return fit_table(satellite, session, settings, profiles=profiles, progress=progress)


def fit_prepared(
    prepared: PreparedSession,
    satellite: SatelliteNumbers,
    settings: FitSettings,
    *,
    limb: Path | None = None,
    profiles: Sequence[str] = (),
    progress: Progress = lambda *_: None,
    sky_ahead: bool = False,
) -> SessionFit:
    """The same from a session whose orbit is there; with `sky_ahead` what a report shows is computed beside the fit."""
    if not jax.config.read("jax_enable_x64"):
        raise ValueError("a fit works in 64-bit numbers and JAX in 32-bit ones: call jaxsat.set_up_jax() first")
    path = prepared.session.path
    sighted = LimbInput.read(limb, prepared.session, settings)
    samples = prepared.observations(settings.arc_s, sighted.angles)
    sky = look_around(prepared, samples, at_once=sky_ahead)
    nominal = nominal_model(satellite)
    try:
        result = estimate(samples, nominal, settings, progress=progress, at_minimum=lambda *_: None)
    except InputError as error:
        source = limb if error.field == LIMB_FIELD else path
        raise InputError(error.reason, file=source, row=error.row, field=error.field) from None
    return SessionFit(
        result,
        prepared,
        satellite,
        settings,
        sky,
        limb=sighted.matched,
        witness=magnetometer_witness(result, prepared.session),
        remarks=sighted.remarks,
    )
