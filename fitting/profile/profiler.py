"""The profiles that a fit is asked for, taken when it is at the minimum."""

from collections.abc import Sequence

from fitting.identify import Identified
from fitting.parameters.free import FreeParameters
from fitting.profile.profile import Profile, check_profile, profile_all
from fitting.solvers.refine import LIKELIHOODS
from fitting.starts.multi_start import Progress


class Profiler:
    """Called by the fit with its minima; afterwards holds the `profiles`, and the `reasons` why others are missing."""

    def __init__(self, names: Sequence[str], parameters: FreeParameters, likelihood: str, progress: Progress):
        """Raises `InputError`, before the work of the fit, where a name is not free in it."""
        for name in names:
            check_profile(parameters, name)
        self.profiles: tuple[Profile, ...] = ()
        self.reasons: tuple[str, ...] = ()
        self._names, self._progress = tuple(names), progress
        self._tail = LIKELIHOODS[likelihood][-1].tail

    def __call__(self, found: Identified) -> None:
        """Takes the profiles about the best of the minima."""
        if not self._names:
            return
        best = found.minima[0]
        profiles, reasons = profile_all(
            best.problem, found.parameters, best.refined, self._names, tail=self._tail, progress=self._progress
        )
        self.profiles, self.reasons = tuple(profiles), tuple(reasons)
