"""Identification: attitude and satellite parameters from telemetry.

Nothing is imported here before it is asked for: names of parameters are wanted where JAX is not.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import fit_orbit as fit_orbit
    from fitting.outcome.posterior import sample_posterior as sample_posterior
    from fitting.run import fit as fit
    from fitting.sensed_run import SensedFit as SensedFit
    from fitting.sensed_run import fit_table as fit_table
    from fitting.sensed_settings import SensedSettings as SensedSettings
    from fitting.session import prepare_session as prepare_session

_PLACES = {
    "fit": "fitting.run",
    "fit_table": "fitting.sensed_run",
    "SensedFit": "fitting.sensed_run",
    "SensedSettings": "fitting.sensed_settings",
    "prepare_session": "fitting.session",
    "fit_orbit": "fitting.orbit.orbit_fit",
    "sample_posterior": "fitting.outcome.posterior",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'fitting' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)
