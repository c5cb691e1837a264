"""Orbits from NORAD mean elements through SGP4: a NumPy edge, evaluated before anything is traced."""

import math

import erfa
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from sgp4.api import SGP4_ERRORS, Satrec

from jaxsat.environment.orbit.sampled import LEAST_INTERVALS, WINDOW, SampledOrbit
from jaxsat.math.sizes import few_sizes
from jaxsat.time import SECONDS_PER_DAY, Epoch, equinox_difference

_METRES_PER_KM = 1e3
# The fastest term of nutation that matters has a period of days: over 3 h a cubic errs by less than 1e-13 rad.
_EQUINOX_STEP_S = 10800.0


def sgp4_orbit(
    satellite: Satrec, epoch: Epoch, *, start: int | float, stop: int | float, step: int | float = 60.0
) -> SampledOrbit:
    """Return the orbit of mean elements from `start` to `stop` [s after `epoch`], sampled every `step` [s] or less.

    The samples are SGP4's own states (Vallado et al. 2006), turned from its frame to the true equinox of date. Between
    them a low orbit is within 0.4 m of SGP4 at 60 s, because SGP4's velocity is not quite the derivative of its
    position (0.02 m/s). Raises ValueError with the time and SGP4's reason where it fails, such as a decay.
    """
    if not (stop > start and step > 0.0):
        raise ValueError(f"start, stop and step must satisfy start < stop and step > 0, got {start}, {stop}, {step}")
    # Of few sizes, so that spans of other lengths share what is compiled for an orbit.
    intervals = few_sizes(max(math.ceil((stop - start) / step), WINDOW - 1), LEAST_INTERVALS)
    t_s = np.linspace(start, stop, intervals + 1)
    position, velocity = true_from_teme(*teme_states(satellite, epoch, t_s), epoch, t_s)
    return SampledOrbit(start, (stop - start) / intervals, position, velocity)


def teme_states(
    satellite: Satrec, epoch: Epoch, t_s: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Return SGP4's positions [m] and velocities [m/s], true equator and mean equinox, `t_s` seconds after `epoch`.

    Time runs in SI seconds from the elements' epoch, leap seconds counted. Raises ValueError where SGP4 fails.
    """
    days = (epoch.seconds_since(elements_epoch(satellite)) + np.asarray(t_s, float)) / SECONDS_PER_DAY
    errors, position_km, velocity_km_s = satellite.sgp4_array(
        np.full(days.shape, satellite.jdsatepoch), satellite.jdsatepochF + days
    )
    # A damaged element set can pass through SGP4 as NaN with error 0.
    damaged = ~np.all(np.isfinite(position_km) & np.isfinite(velocity_km_s), axis=1)
    if np.any(failed := (errors != 0) | damaged):
        k = int(np.argmax(failed))
        reason = SGP4_ERRORS.get(int(errors[k]), "the state is not finite")
        when = f"{epoch.shifted(float(t_s[k])).iso(0)} UTC, {days[k]:+.2f} days from the epoch of its elements"
        raise ValueError(f"SGP4 cannot place satellite {satellite.satnum} at {when}: {reason}")
    return position_km * _METRES_PER_KM, velocity_km_s * _METRES_PER_KM


def elements_epoch(satellite: Satrec) -> Epoch:
    """Return the epoch of mean elements."""
    days = satellite.jdsatepoch - 2400000.5
    midnight = math.floor(days)
    year, month, day, _ = erfa.jd2cal(2400000.5, midnight)
    seconds = ((days - midnight) + satellite.jdsatepochF) * SECONDS_PER_DAY
    return Epoch.from_utc(int(year), int(month), int(day)).shifted(seconds)


def true_from_teme(
    position_teme: Float[np.ndarray, "n 3"],
    velocity_teme: Float[np.ndarray, "n 3"],
    epoch: Epoch,
    t_s: Float[np.ndarray, "n"],
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Return positions and velocities in the true equator and equinox of date, from the mean equinox of SGP4.

    A turn about the pole by apparent sidereal time (`jaxsat.time.greenwich_angle`) less the mean sidereal time of 1982,
    from which SGP4's frame is counted (Vallado et al. 2006, appendix C): places over the Earth are kept exactly. The
    velocities are made the derivatives of the new components, 4e-5 m/s beyond the turn in a low orbit.
    """
    angle, rate = _equinox_difference(epoch, t_s)
    velocity = _about_pole(velocity_teme, angle) + rate[:, None] * _about_pole(
        np.stack([-position_teme[:, 1], position_teme[:, 0], np.zeros(len(t_s))], axis=1), angle
    )
    return _about_pole(position_teme, angle), velocity


def _about_pole(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)


def _equinox_difference(epoch: Epoch, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`equinox_difference` [rad] and its rate [rad/s] at `t_s` after the epoch; UT1 is taken as UTC."""
    start, end = float(np.min(t_s)), float(np.max(t_s))
    grid = np.linspace(start, max(end, start + 1.0), 4 + int((end - start) / _EQUINOX_STEP_S))
    difference = [equinox_difference(epoch.shifted(float(t))) for t in grid]
    spline = CubicSpline(grid, difference)
    return spline(t_s), spline(t_s, 1)
