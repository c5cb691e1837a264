"""Profile likelihood of one parameter: the lowest cost that the others allow at each of its values.

Where the cost is not a parabola out to a few sigmas (a bound near by, an angle of a short arc, a weak prior) the sigma
of the information matrix misleads; the interval in which the profile rises by less than 1/2, or 1.92, does not (Wilks
1938; Venzon & Moolgavkar 1988).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from fitting.measurements.abstract import RATE_UNIT, AbstractProblem
from fitting.outcome.uncertainty import at_bound, covariance
from fitting.parameters.free import FreeParameters
from fitting.parameters.names import STATE
from fitting.parameters.quoted import quoted_names, quoted_slopes, quoted_units, values_jacobian
from fitting.profile.holding import choose_held, sigma_along
from fitting.profile.walk import Held, Step, walk
from fitting.solvers.least_squares import prior_information
from fitting.solvers.refine import CONVERGED_DECREMENT, Refined
from fitting.starts.multi_start import NONE, Progress
from jaxsat.errors import InputError
from jaxsat.satellites.model import POLAR_PLACE

AZIMUTH = (POLAR_PLACE, (1,))
REACH = 3.0
"""How far a profile goes: the root of twice the cost's rise [sigma]."""
Z_68, Z_95 = 1.0, 1.959964
"""Roots of twice the rise that bound 68.3 and 95 %: quantiles of chi-square with one degree of freedom (Wilks 1938)."""
Interval = tuple[float | None, float | None]


@dataclass(frozen=True)
class Profile:
    """Cost over the values of one parameter, all others at their best; arrays run over its values, which rise."""

    name: str
    unit: str
    best: float
    """Value at the minimum. That of `attitude.x` ... is a small rotation about a body axis: zero at the minimum."""
    sigma: float | None
    """1-sigma of the information matrix; None where it has none, as at a bound."""
    values: np.ndarray
    rise: np.ndarray
    """Cost, half of chi2, above the minimum's, priors included."""
    rise_data: np.ndarray
    """The part of the data in it; below zero where the prior pulls the minimum off the data's."""
    settled: np.ndarray
    """False where the solver stopped before it had the lowest cost, so that the rise is too large."""
    interval_68: Interval
    """Where the rise is below 1/2. The bound where the profile ends at it; None where it has not risen enough."""
    interval_95: Interval
    """Where the rise is below 1.92."""
    note: str = ""
    """What is wrong with it; empty where nothing is."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON: plain numbers and lists."""
        arrays = ("values", "rise", "rise_data", "settled")
        return {**asdict(self), **{name: getattr(self, name).tolist() for name in arrays}}


def profile(
    problem: AbstractProblem,
    parameters: FreeParameters,
    refined: Refined,
    name: str,
    *,
    tail: float = NONE,
    progress: Progress = lambda *_: None,
) -> Profile:
    """Profile of a free parameter, or of a component of the state, about the best minimum of a fit.

    `tail` is that of the likelihood under which `refined` was reached (`fitting.solvers.refine.LIKELIHOODS`, last
    round).
    Raises `InputError` as `check_profile` does, and where the data say nothing of the parameter or nothing but together
    with others of its gauge.
    """
    check_profile(parameters, name)
    best = jax.tree.map(lambda leaf: np.asarray(leaf)[0], refined.points)
    slopes = quoted_slopes(parameters, values_jacobian(parameters, best.x))
    number = quoted_names(parameters).index(name)
    lower, upper = parameters.bounds()
    k = parameters.names.index(name)
    free = parameters.everything & ~at_bound(best.x, best.gradient, (lower, upper))
    cov = covariance(best.hessian, free, prior_information(len(free)))
    sigma = sigma_along(slopes[number], cov) if free[k] else None
    free[k] = True
    held, spread = choose_held(parameters, name, slopes[number], best.hessian, free)
    reached = walk(problem, parameters, best, Held(k, held, spread), reach=REACH, tail=tail, progress=progress)

    values = np.array([_value(parameters, k, best.reference, step) for step in reached])
    prior = np.array([0.5 * np.sum(step.x[len(STATE) :] ** 2) for step in reached])
    rise, settled = (np.array([getattr(step, field) for step in reached]) for field in ("rise", "settled"))
    order = np.argsort(values)
    values, rise, prior, settled = values[order], rise[order], prior[order], settled[order]
    middle = [step.offset for step in reached].index(0.0)
    middle = int(np.flatnonzero(order == middle)[0])
    # The walk ends on a bound exactly; under it the profile does not go on.
    ends = [step.x[k] for step in (reached[order[0]], reached[order[-1]])]
    walls = (bool(ends[0] <= lower[k] + 1e-9), bool(ends[1] >= upper[k] - 1e-9))
    notes = []
    if rise.min() < -CONVERGED_DECREMENT:
        notes.append(f"the cost falls by {-rise.min():.2g} beside the minimum: the fit has not reached the lowest")
    if not settled.all():
        notes.append(f"the solver stopped early at {(~settled).sum()} of {len(settled)} values")
    return Profile(
        name=name,
        unit=quoted_units(parameters)[number],
        best=float(values[middle]),
        sigma=sigma,
        values=values,
        rise=rise,
        rise_data=rise - (prior - prior[middle]),
        settled=settled,
        interval_68=interval(values, rise, middle, Z_68, walls),
        interval_95=interval(values, rise, middle, Z_95, walls),
        note="; ".join(notes),
    )


def profile_all(
    problem: AbstractProblem,
    parameters: FreeParameters,
    refined: Refined,
    names: Sequence[str],
    *,
    tail: float = NONE,
    progress: Progress = lambda *_: None,
) -> tuple[list[Profile], list[str]]:
    """Profiles as `profile` gives them, and for each parameter that has none the reason: a fit is not lost for it."""
    profiles, reasons = [], []
    for name in dict.fromkeys(names):
        try:
            profiles.append(profile(problem, parameters, refined, name, tail=tail, progress=progress))
        except InputError as error:
            reasons.append(error.reason)
    return profiles, reasons


def check_profile(parameters: FreeParameters, name: str) -> None:
    """Raises `InputError` unless `name` is one of the fit's unknowns."""
    known = quoted_names(parameters)
    if name not in known:
        close = next((each for each in known if each.startswith(f"{name}.")), None)
        close = close or next(iter(get_close_matches(name, known, n=1)), None)
        hint = f"; did you mean {close}?" if close else f"; expected a single number such as {known[-1]}"
        raise InputError(f"unknown parameter {name!r}{hint}", field="profile")
    free = [each for each, moves in zip(parameters.names, parameters.everything, strict=True) if moves]
    if name not in free:
        reason = f"{name} is not free in this fit and has no profile; free are {', '.join(free) or 'none'}"
        raise InputError(reason, field="profile")


def interval(
    values: np.ndarray, rise: np.ndarray, middle: int, z: float, walls: tuple[bool, bool] = (False, False)
) -> Interval:
    """The values about number `middle` between which the cost rises by less than z^2 / 2.

    Where an end is not reached, it is the last value if there is a wall, else None. The cubic between the values is
    exact for a parabola, whether its minimum is that of the fit or lies behind a bound.
    """
    level = 0.5 * z * z

    def end(index: np.ndarray, wall: bool) -> float | None:
        beyond = np.flatnonzero(rise[index] >= level)
        if not len(beyond):
            return float(values[index[-1]]) if wall else None
        inner, outer = sorted(float(values[index[n]]) for n in (beyond[0] - 1, beyond[0]))
        # A crossing at the outer value itself may be lost to a rounding.
        crossings = np.append(CubicSpline(values, rise).solve(level, extrapolate=False), values[index[beyond[0]]])
        crossings = np.clip(crossings, inner, outer)
        return float(crossings[np.argmin(np.abs(crossings - 0.5 * (inner + outer)))])

    return end(np.arange(middle, -1, -1), walls[0]), end(np.arange(middle, len(values)), walls[1])


def _value(parameters: FreeParameters, unknown: int, origin: np.ndarray, step: Step) -> float:
    """The parameter at a point of the walk, in its unit."""
    if unknown < 3:
        return float(np.degrees(_rotation(origin, step.reference)[unknown]))
    if unknown < len(STATE):
        return float(np.degrees(step.x[unknown] * RATE_UNIT))
    number = parameters.columns[unknown - len(STATE)]
    value = float(np.asarray(parameters.tree.values(jnp.asarray(step.x[len(STATE) :])))[number])
    if parameters.leaves[number].spot == AZIMUTH:
        # Counted on from the nominal azimuth, so that a profile does not jump by a turn.
        middle = float(np.asarray(parameters.tree.nominal)[number])
        value = middle + float(np.angle(np.exp(1j * (value - middle))))
    return value * parameters.leaves[number].to_unit


def _rotation(origin: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """[3] rotation vector from one attitude to another, in body axes [rad]."""
    w, x, y, z = origin
    matrix = np.array([[w, x, y, z], [-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
    scalar, *vector = matrix @ turned
    length = float(np.linalg.norm(vector))
    return np.array(vector) * (2.0 * np.arctan2(length, scalar) / length if length > 0.0 else 2.0)
