"""The profiles that a fit is asked for, taken when it is at the minimum."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fitting.parameters.parametrization import parametrization
from fitting.profile.profile import Profile, check_profile, profile_all
from fitting.solvers.refine import LIKELIHOODS
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from fitting.measurements.problem import Problem
    from fitting.parameters.nominal import Nominal
    from fitting.parameters.parametrization import Parametrization
    from fitting.settings import FitSettings
    from fitting.solvers.refine import Refined
    from fitting.starts.multi_start import Progress


class Profiler:
    """Called by the fit with its minimum; afterwards holds the `profiles`, and the `reasons` why others are missing."""

    def __init__(self, names: Sequence[str], nominal: "Nominal", settings: "FitSettings", progress: "Progress"):
        """Raises `InputError`, before the work of the fit, where a name is not free in it."""
        if names and settings.adaptive.on:
            raise InputError("a profile needs a likelihood, which the adaptive weights are not", field="--profile")
        free = parametrization(nominal, settings.free_names, settings.prior_sigma)
        for name in names:
            check_profile(free, name)
        self.profiles: list[Profile] = []
        self.reasons: list[str] = []
        self._names, self._progress = tuple(names), progress
        self._tail = LIKELIHOODS[settings.likelihood][-1].tail

    def __call__(self, problem: "Problem", parameters: "Parametrization", refined: "Refined") -> None:
        """Takes the profiles about the best of the minima."""
        self.profiles, self.reasons = profile_all(
            problem, parameters, refined, self._names, tail=self._tail, progress=self._progress
        )
