"""Identification: attitude and satellite parameters from telemetry.

Nothing is imported here before it is asked for: names of parameters are wanted where JAX is not.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.fitted import Fit as Fit
    from fitting.orbit.orbit_fit import fit_orbit as fit_orbit
    from fitting.outcome.posterior import sample_posterior as sample_posterior
    from fitting.run import fit as fit
    from fitting.sensitivity.analysis import sensitivity_of as sensitivity_of
    from fitting.session import prepare_session as prepare_session
    from fitting.settings import FitSettings as FitSettings
    from fitting.starts.guess import Guess as Guess
    from fitting.starts.guess_files import read_guess as read_guess

_PLACES = {
    "fit": "fitting.run",
    "sensitivity_of": "fitting.sensitivity.analysis",
    "Fit": "fitting.fitted",
    "FitSettings": "fitting.settings",
    "Guess": "fitting.starts.guess",
    "read_guess": "fitting.starts.guess_files",
    "prepare_session": "fitting.session",
    "fit_orbit": "fitting.orbit.orbit_fit",
    "sample_posterior": "fitting.outcome.posterior",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'fitting' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)
