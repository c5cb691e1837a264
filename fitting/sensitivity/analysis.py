"""What limits the accuracy of a fit, before flight or after: all that `jaxsat sensitivity` tells of one motion."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import numpy as np

from fitting.outcome.uncertainty import attitude_covariance, correlations
from fitting.parameters.invisible import PRIORS
from fitting.parameters.null_space import Direction, unseen_directions
from fitting.sensitivity.choice import Choice, choose
from fitting.sensitivity.contributions import Contributions, contributions
from fitting.sensitivity.directions import Linearity, Worst, linearity, linearity_of_bias, worst_directions
from fitting.sensitivity.information import Known, Quoted, known, quoted
from fitting.sensitivity.of_fit import free_of_fit, vantage_of_fit
from fitting.sensitivity.plan import Columns, vantage_of_plan
from fitting.sensitivity.sampling import SamplingMap, sampling_map
from fitting.sensitivity.told import Told, told_without_end
from fitting.sensitivity.vantage import Vantage
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.synthetic.twins import TwinSettings

if TYPE_CHECKING:
    from fitting.fitted import Fit

Progress = Callable[[str, int, int], None]
STRONG = 0.9
"""Correlation from which two numbers are told as one."""
SHOWN = 12
"""Strongest correlations that are kept."""


@dataclass(frozen=True)
class Sensitivity:
    """Of one motion, one choice of what is fitted and one of what is considered."""

    vantage: Vantage
    choice: Choice
    found: Known
    quoted: Quoted
    unseen: tuple[Direction, ...]
    """Combinations on which the priors say more than the data."""
    worst: tuple[Worst, ...]
    linearity: tuple[Linearity, ...]
    contributions: Contributions
    sampling: SamplingMap | None
    correlations: tuple[tuple[str, str, float], ...]
    """The strongest first."""
    timing_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def told_by_priors(self) -> tuple[Direction, ...]:
        """Combinations that are held by priors and not by definition."""
        return tuple(each for each in self.unseen if each.held_by == PRIORS)

    @property
    def regular(self) -> bool:
        """Whether sigmas are those of the data and of a picture that is linear across them.

        What is held by definition, as the size of a dipole by a gauge, is no matter of data.
        """
        return not self.told_by_priors and all(each.holds_to >= 1.0 for each in self.linearity)

    @property
    def attitude_sigma_deg(self) -> tuple[np.ndarray, np.ndarray]:
        """[samples] 1-sigma of the attitude, three axes together, from noise and from what is assumed [deg]."""
        found = self.found
        noise = np.trace(attitude_covariance(found.turn_by_free, found.noise), axis1=1, axis2=2)
        assumed = (found.turn_by_considered**2).sum(axis=(1, 2))
        return np.degrees(np.sqrt(np.maximum(noise, 0.0))), np.degrees(np.sqrt(assumed))

    @property
    def attitude_rms_deg(self) -> tuple[float, float, float]:
        """RMS over the arc: from noise, from what is assumed, from both [deg]."""
        noise, assumed = (float(np.sqrt(np.mean(each**2))) for each in self.attitude_sigma_deg)
        return noise, assumed, float(np.hypot(noise, assumed))

    @property
    def without_end(self) -> Told | None:
        """What a fit of all but the last tenth of the arc would be told, and by what it would miss that tenth.

        None where the last tenth has no reading that counts, or all have.
        """
        try:
            return told_without_end(self.found, self.vantage.samples.t)
        except ValueError:
            return None

    def bias_per_unit(self) -> dict[str, dict[str, float]]:
        """{considered: {fitted: by what its estimate is off}} where the considered number is off by one of its unit.

        To first order, each in its own unit; `attitude_rms_deg` is the RMS over the arc of the turn [deg].
        """
        leaves = {leaf.name: leaf for leaf in self.vantage.satellite.leaves}
        table = {}
        for k, (name, sigma) in enumerate(zip(self.choice.considered, self.choice.sigma, strict=True)):
            unit = float(sigma * leaves[name].to_unit)
            own = {
                row.name: float(shift / unit)
                for row, shift in zip(self.quoted.rows, self.quoted.shift[:, k], strict=True)
            }
            turn = float(np.degrees(np.sqrt(np.mean((self.found.turn_by_considered[..., k] ** 2).sum(axis=1)))))
            table[name] = {"attitude_rms_deg": turn / unit, **own}
        return table


def sensitivity_of(
    place: "Satellite | Fit",
    plan: TwinSettings | None = None,
    *,
    free: str | Sequence[str] | None = None,
    consider: str | Sequence[str] = (),
    orbit: Path | None = None,
    columns: Columns | None = None,
    parts: int = 10,
    progress: Progress = lambda *_: None,
) -> Sensitivity:
    """What limits accuracy: of a satellite (`jaxsat.read_satellite`) by a plan, or of a fit (`fitting.fit`) as it was.

    `plan` (`jaxsat.synthetic.twins.TwinSettings`) says instant, length [s], interval [s], attitude and rate at the
    start, `orbit` a file in place of the satellite file's, `columns` commands: before flight alone. `free` names what
    is fitted, by default every number with a sigma, or what the fit found; `consider` what is not fitted but uncertain,
    by the sigma of the satellite file or as NAME=SIGMA in its unit. Covariance and consider covariance follow Tapley,
    Schutz & Born (2004), sections 6.5 and 6.6. Raises `InputError` for names that are none, an orbit that does not
    reach, derivatives that have no room, and ValueError where JAX works in single precision.
    """
    if not jax.config.read("jax_enable_x64"):
        raise ValueError("derivatives need 64-bit numbers and JAX works in 32-bit ones: call jaxsat.set_up_jax() first")
    began = time.perf_counter()
    progress("the motion and its derivatives", 0, 0)
    if isinstance(place, Satellite):
        vantage = vantage_of_plan(place, plan, orbit=orbit, columns=columns)
    else:
        if plan is not None or orbit is not None or columns is not None:
            raise ValueError("a fit has its own plan, orbit and commands")
        vantage = vantage_of_fit(place)
        free = free_of_fit(place.result, place.satellite, place.settings) if free is None else free
    found = analysed(vantage, _names(free), _names(consider) or (), parts=parts, progress=progress)
    return timed(found, time.perf_counter() - began)


def analysed(
    vantage: Vantage,
    free: Sequence[str] | None = None,
    consider: Sequence[str] = (),
    *,
    parts: int = 10,
    progress: Progress = lambda *_: None,
) -> Sensitivity:
    """The same of a motion with its derivatives; raises `InputError` for names, and where nothing is fitted."""
    progress("the motion and its derivatives", 0, 0)
    slopes = vantage.slopes
    began = time.perf_counter()
    choice = choose(vantage, free, consider)
    if not choice.kept.any():
        raise InputError("nothing is fitted: the motion is given and no number is free", field="free")
    progress("information", 0, 0)
    found = known(vantage, choice, slopes)
    told = quoted(vantage, found)
    progress("contributions", 0, 0)
    shares = contributions(vantage, found, parts=parts)
    progress("arcs and intervals", 0, 0)
    sampling = sampling_map(vantage, found, told)
    progress("linearity", 0, 0)
    straight = linearity(vantage, found) + linearity_of_bias(vantage, found)
    return Sensitivity(
        vantage=vantage,
        choice=choice,
        found=found,
        quoted=told,
        unseen=_unseen(vantage, choice, found),
        worst=worst_directions(found),
        linearity=straight,
        contributions=shares,
        sampling=sampling,
        correlations=_strongest(told),
        timing_s={"algebra": time.perf_counter() - began},
    )


def _names(given: str | Sequence[str] | None) -> list[str] | None:
    if given is None or not isinstance(given, str):
        return None if given is None else list(given)
    return [part for part in given.split(",") if part.strip()]


def _unseen(vantage: Vantage, choice: Choice, found: Known) -> tuple[Direction, ...]:
    size = len(choice.kept)
    information = np.zeros((size, size))
    information[np.ix_(choice.kept, choice.kept)] = found.information
    about = choice.values, choice.values_jacobian, vantage.model
    return unseen_directions(choice.parameters, information, choice.kept, *about)


def _strongest(told: Quoted) -> tuple[tuple[str, str, float], ...]:
    names = [row.name for row in told.rows]
    table = correlations(names, told.covariance, set(names))
    pairs = [(a, b, value) for a, row in table.items() for b, value in row.items()]
    return tuple(sorted(pairs, key=lambda pair: -abs(pair[2]))[:SHOWN])


def timed(found: Sensitivity, total: float) -> Sensitivity:
    """With the seconds that all of it took, derivatives and what compiled them included."""
    return replace(found, timing_s={**found.timing_s, "total": total})
