"""The main job from Python: telemetry in, attitude, parameters and a verdict out, written as by `jaxsat fit`."""

from collections.abc import Sequence

from fitting.sensed_run import SensedFit, fit_table
from fitting.sensed_settings import SensedSettings
from fitting.starts.multi_start import Progress
from jaxsat.given import Given
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession


def fit(
    satellite: Satellite,
    session: TableSession,
    *,
    free: str | Sequence[str] | None = None,
    holdout: float | None = None,
    settings: SensedSettings | None = None,
    given: Given | None = None,
    profiles: Sequence[str] = (),
    progress: Progress = lambda *_: None,
) -> SensedFit:
    """Fits attitude and parameters to what the sensors of a satellite measured.

    `satellite` (`jaxsat.read_satellite`) holds the nominal values and the sensors, `session` (`jaxsat.read_telemetry`)
    the telemetry. `free` names what is fitted and `holdout` the share of the time that is only predicted, in place of
    those of `settings`; `given` is what of orbit, Earth and Sun shall not be found from session and satellite;
    `profiles` names free parameters whose cost is walked along. A fit that does not converge is a result with that
    status. Raises `InputError` for what cannot be fitted, ValueError (pydantic's) for a setting that cannot be, and
    ValueError where JAX works in single precision.
    """
    settings = settings or SensedSettings()
    if free is not None:
        settings = settings.changed(free=tuple(free.split(",") if isinstance(free, str) else free))
    if holdout is not None:
        settings = settings.changed(holdout=holdout)
    return fit_table(satellite, session, settings, given=given, profiles=profiles, progress=progress)
