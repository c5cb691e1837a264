"""Keplerian elements from positions: start from averaged integrals, then robust least squares (the program `raw_Or`).

Penkov et al. 2009, section 3.7: the start comes from the mean energy, area and Laplace integrals, the refinement uses
positions only. The variables are equinoctial elements about the mean plane of the data: regular for circular and for
equatorial orbits, where the Jacobian in classical elements loses rank. Six numbers on some hundred points need no
compiler: this is NumPy with the exact Jacobian, a few milliseconds in a cold process where tracing alone takes longer.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np

from fitting.orbit.equinoctial import (
    ELEMENT_UNITS,
    argument_of_latitude,
    classical_elements,
    mean_longitude,
    positions_and_jacobian,
)
from jaxsat.constants import EARTH_MU, EARTH_RADIUS_MEAN
from jaxsat.environment.orbit import KeplerOrbit
from jaxsat.errors import InputError

_MAX_ECCENTRICITY = 0.95
_MIN_SAMPLES = 3
OUTLIER_SIGMAS = 6.0
"""Positions further off than this are doubtful."""
Average = Callable[..., Any]
"""As `np.median`, which a few wild samples do not move, or `np.mean`, which is that of Penkov et al. 2009."""


@dataclass(frozen=True)
class OrbitFit:
    """A Kepler orbit fitted to positions, with what the fit thinks of itself."""

    orbit: KeplerOrbit
    """t = 0 is that of the times fitted."""
    elements: dict[str, float]
    """Semi-major axis [m], eccentricity, angles [rad]; the mean anomaly is that at t = 0."""
    sigma: dict[str, float]
    """1-sigma of each, from the residual scatter."""
    time_of_perigee_s: float
    """First passage at or after t = 0 [s]."""
    argument_of_latitude: float
    """At t = 0 [rad, -pi to pi]."""
    residual_before_m: np.ndarray
    """[time 3] measured - orbit of the averaged integrals."""
    residual_after_m: np.ndarray
    """[time 3] measured - fitted orbit."""
    rms_before_m: float
    """Of one coordinate, samples that are not outliers."""
    rms_after_m: float
    outlier: np.ndarray
    """[time] positions that took no part: impossible, or beyond 6 sigma."""
    iterations: int
    converged: bool
    message: str


def initial_elements(
    t_s: np.ndarray,
    position_eci_m: np.ndarray,
    velocity_eci_m_s: np.ndarray,
    mu: float = EARTH_MU,
    *,
    average: Average = np.median,
) -> dict[str, float]:
    """Returns classical elements from the averaged energy, area and Laplace integrals; keys of `ELEMENT_UNITS`.

    The `average` is taken component by component.
    Raises `InputError` where the averages are not those of an ellipse.
    """
    frame, start = _start(t_s, position_eci_m, velocity_eci_m_s, mu, average=average)
    return classical_elements(start, frame)


def fit_without_doubtful(
    t_s: np.ndarray,
    position_eci_m: np.ndarray,
    velocity_eci_m_s: np.ndarray,
    *,
    sigmas: float = OUTLIER_SIGMAS,
    average: Average = np.median,
    file: str | Path | None = None,
) -> tuple["OrbitFit", "OrbitFit"]:
    """Fits all positions outside the Earth, then finds start and elements again without those beyond `sigmas`.

    The residuals of both are of all samples; what the second leaves out is its `outlier`. Raises as `fit_orbit` does.
    """
    options = {"average": average, "file": file}
    judged = fit_orbit(t_s, position_eci_m, velocity_eci_m_s, outlier_sigmas=sigmas, **options)
    fits = []
    for good in (np.isfinite(judged.residual_after_m).all(axis=1), ~judged.outlier):
        chosen = t_s[good], position_eci_m[good], velocity_eci_m_s[good]
        fit = fit_orbit(*chosen, outlier_sigmas=math.inf, **options)
        orbits = KeplerOrbit(**initial_elements(*chosen, average=average)), fit.orbit
        before, after = (position_eci_m - _positions(orbit, t_s) for orbit in orbits)
        fits.append(dataclasses.replace(fit, outlier=~good, residual_before_m=before, residual_after_m=after))
    return fits[0], fits[1]


def fit_orbit(
    t_s: np.ndarray,
    position_eci_m: np.ndarray,
    velocity_eci_m_s: np.ndarray,
    *,
    mu: float = EARTH_MU,
    average: Average = np.median,
    outlier_sigmas: float = OUTLIER_SIGMAS,
    file: str | Path | None = None,
) -> OrbitFit:
    """Fits a Kepler orbit to positions [time 3]; velocities [time 3] serve the start only. `file` is for messages.

    Positions inside the Earth take no part; the others get Huber weights until the scatter is known, then those beyond
    `outlier_sigmas` are left out and the rest fitted with equal weights; infinity leaves none out. The start is
    from the `average` of the integrals, component by component. Raises `InputError` where fewer than three usable
    positions at different times remain or where they are not those of an ellipse.
    """
    radius = np.linalg.norm(position_eci_m, axis=1)
    possible = np.isfinite(position_eci_m).all(axis=1) & (radius > EARTH_RADIUS_MEAN)
    if np.unique(t_s[possible]).size < _MIN_SAMPLES:
        reason = (
            f"{np.sum(possible)} of {t_s.size} positions lie outside the Earth; "
            f"an orbit needs {_MIN_SAMPLES} at different times"
        )
        raise InputError(reason, file=file, field="position")
    t, measured = t_s[possible], position_eci_m[possible]
    frame, start = _start(t, measured, velocity_eci_m_s[possible], mu, file, average)

    before = measured - positions_and_jacobian(t, start, frame, mu)[0]
    fitted, iterations, _ = _least_squares(t, measured, start, frame, mu, robust=True)
    residual = measured - positions_and_jacobian(t, fitted, frame, mu)[0]
    good = _distance(residual) <= outlier_sigmas * _scale(residual)
    if np.unique(t[good]).size < _MIN_SAMPLES:
        good[:] = True
    fitted, more, converged = _least_squares(t[good], measured[good], fitted, frame, mu, robust=False)
    after = measured - positions_and_jacobian(t, fitted, frame, mu)[0]

    rms = _rms(after[good])
    sigma = _sigma(t[good], fitted, frame, mu, rms)
    elements = classical_elements(fitted, frame)
    mean_motion = math.sqrt(mu / elements["semi_major_axis"] ** 3)
    outlier = np.ones(t_s.size, dtype=bool)
    outlier[np.flatnonzero(possible)[good]] = False
    message = f"positions within {rms / 1e3:.3f} km (RMS of a coordinate) of one Kepler orbit"
    if np.any(outlier):
        message += f", {np.sum(outlier)} of {t_s.size} left out as outliers"
    return OrbitFit(
        orbit=KeplerOrbit(**elements, mu=mu),
        elements=elements,
        sigma=sigma,
        time_of_perigee_s=(-elements["mean_anomaly"] % (2.0 * math.pi)) / mean_motion,
        argument_of_latitude=argument_of_latitude(elements),
        residual_before_m=_spread(before, possible),
        residual_after_m=_spread(after, possible),
        rms_before_m=_rms(before[good]),
        rms_after_m=rms,
        outlier=outlier,
        iterations=iterations + more,
        converged=converged,
        message=message if converged else "did not converge: " + message,
    )


def given_orbit(
    elements: dict[str, float], t_s: np.ndarray, position_eci_m: np.ndarray, *, mu: float = EARTH_MU
) -> OrbitFit:
    """An orbit that is known, in the form of a fitted one: keys of `ELEMENT_UNITS`, no sigma, residuals for judging."""
    orbit = KeplerOrbit(**elements, mu=mu)
    residual = position_eci_m - _positions(orbit, t_s)
    rms = _rms(residual)
    return OrbitFit(
        orbit=orbit,
        elements=elements,
        sigma=dict.fromkeys(elements, math.nan),
        time_of_perigee_s=(-elements["mean_anomaly"] % (2.0 * math.pi)) / float(orbit.mean_motion),
        argument_of_latitude=argument_of_latitude(elements),
        residual_before_m=residual,
        residual_after_m=residual,
        rms_before_m=rms,
        rms_after_m=rms,
        outlier=np.zeros(t_s.size, dtype=bool),
        iterations=0,
        converged=True,
        message=f"given by the configuration, {rms / 1e3:.3f} km from the positions (RMS of a coordinate)",
    )


def states(orbit: KeplerOrbit, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns positions [time 3] [m] and velocities [time 3] [m/s] of an orbit."""
    position, velocity = _propagate(orbit, t_s)
    return np.asarray(position), np.asarray(velocity)


def _positions(orbit: KeplerOrbit, t_s: np.ndarray) -> np.ndarray:
    return states(orbit, t_s)[0]


@eqx.filter_jit
def _propagate(orbit, t):
    return jax.vmap(orbit)(t)


def _start(t, position, velocity, mu, file=None, average: Average = np.median) -> tuple[np.ndarray, np.ndarray]:
    """Frame [3 3] of the mean plane (two axes in it, its normal) and equinoctial elements (a, k, h, l, 0, 0)."""
    radius = np.linalg.norm(position, axis=1)
    energy = average(0.5 * np.sum(velocity**2, axis=1) - mu / radius)
    momentum = np.cross(position, velocity)
    area = average(momentum, axis=0)
    laplace = average(np.cross(velocity, momentum) / mu - position / radius[:, None], axis=0)
    ecc = float(np.linalg.norm(laplace))
    if not (energy < 0.0 and np.linalg.norm(area) > 0.0 and ecc < _MAX_ECCENTRICITY):
        reason = (
            f"do not describe an ellipse about the Earth: mean energy {energy:.3g} J/kg (expected below 0), "
            f"eccentricity {ecc:.3g} (expected below {_MAX_ECCENTRICITY})"
        )
        raise InputError(reason, file=file, field="position and velocity")
    normal = area / np.linalg.norm(area)
    # Any axis in the plane will do; the coordinate axis furthest from the normal keeps it well defined.
    first = np.cross(normal, np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal))
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(normal, first), normal])
    a = -0.5 * mu / energy
    k, h, _ = frame @ laplace
    x, y, _ = frame @ position.T
    longitude = mean_longitude(np.arctan2(y, x), k, h) - math.sqrt(mu / a**3) * t
    centre = np.angle(np.exp(1j * longitude[0]))
    offset = np.angle(np.exp(1j * (longitude - centre)))
    return frame, np.array([a, k, h, centre + average(offset), 0.0, 0.0])


def _least_squares(t, measured, elements, frame, mu, *, robust: bool) -> tuple[np.ndarray, int, bool]:
    """Gauss-Newton with step halving; returns elements, iterations, whether it converged."""
    scale = 1.0
    position, jacobian = positions_and_jacobian(t, elements, frame, mu)
    for iteration in range(1, 51):
        residual = measured - position
        weight = np.ones(t.size)
        if robust:
            scale = _scale(residual)
            weight = np.minimum(1.0, 2.0 * scale / np.maximum(_distance(residual), 1e-30))
        cost = _cost(residual, scale, robust)
        root = np.sqrt(weight)[:, None, None]
        columns = np.array([elements[0], 1.0, 1.0, 1.0, 1.0, 1.0])
        matrix = (root * jacobian * columns).reshape(-1, 6)
        step = columns * np.linalg.lstsq(matrix, (root[:, :, 0] * residual).ravel(), rcond=1e-14)[0]
        for _ in range(12):
            trial = elements + step
            if trial[0] > 0.0 and math.hypot(trial[1], trial[2]) < _MAX_ECCENTRICITY:
                position, jacobian = positions_and_jacobian(t, trial, frame, mu)
                # Equal cost is progress enough: at the minimum rounding decides which is lower.
                if _cost(measured - position, scale, robust) <= cost * (1.0 + 1e-12):
                    break
            step = 0.5 * step
        else:
            # No lower point along an exact Gauss-Newton step: at the minimum, to rounding, if the step was small.
            return elements, iteration, bool(np.max(np.abs(step / columns)) < 1e-9)
        elements = trial
        if np.max(np.abs(step / columns)) < (1e-7 if robust else 1e-12):
            return elements, iteration, True
    return elements, 50, False


def _cost(residual, scale, robust) -> float:
    distance = _distance(residual)
    if not robust:
        return float(np.sum(distance**2))
    knee = 2.0 * scale
    return float(np.sum(np.where(distance <= knee, 0.5 * distance**2, knee * (distance - 0.5 * knee))))


def _distance(residual) -> np.ndarray:
    """Length of each residual in units of one coordinate."""
    return np.sqrt(np.sum(residual**2, axis=1) / 3.0)


def _scale(residual) -> float:
    """Scatter of one coordinate [m] from the median distance (chi-square of 3: median 2.366); at least 0.1 mm."""
    return max(float(np.median(_distance(residual))) * math.sqrt(3.0 / 2.366), 1e-4)


def _rms(residual) -> float:
    return float(np.sqrt(np.mean(residual**2))) if residual.size else math.nan


def _spread(residual, possible) -> np.ndarray:
    full = np.full((possible.size, 3), np.nan)
    full[possible] = residual
    return full


def _sigma(t, elements, frame, mu, rms) -> dict[str, float]:
    """1-sigma of the classical elements: linear propagation, the change of variables by central differences."""
    freedom = max(3 * t.size - 6, 1)
    matrix = positions_and_jacobian(t, elements, frame, mu)[1].reshape(-1, 6)
    columns = np.array([elements[0], 1.0, 1.0, 1.0, 1.0, 1.0])
    inverse = np.linalg.pinv(matrix * columns)
    covariance = inverse @ inverse.T * rms**2 * (3 * t.size / freedom)
    change = np.empty((6, 6))
    for j in range(6):
        step = np.zeros(6)
        step[j] = 1e-7 * columns[j]
        high, low = (np.array(list(classical_elements(elements + x, frame).values())) for x in (step, -step))
        difference = high - low
        difference[2:] = np.angle(np.exp(1j * difference[2:]))
        change[:, j] = difference / 2e-7
    sigma = np.sqrt(np.einsum("ij,jk,ik->i", change, covariance, change))
    # An angle that the data do not determine (perigee of a circular orbit) is uniform on the circle at worst.
    sigma[2:] = np.minimum(sigma[2:], math.pi / math.sqrt(3.0))
    return dict(zip(ELEMENT_UNITS, sigma.tolist(), strict=True))
