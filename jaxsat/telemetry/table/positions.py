"""An orbit through positions of a table, which may be irregular, rounded and interrupted."""

import math
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from jaxsat.constants import EARTH_MU
from jaxsat.environment import SampledOrbit
from jaxsat.environment.orbit.sampled import LEAST_INTERVALS
from jaxsat.errors import InputError
from jaxsat.math.sizes import few_sizes

_SPACING_S, _STEP_S = 60.0, 30.0
_DEGREE = 5
_LARGEST_HOLE_S = 1800.0
_LOWEST_M, _HIGHEST_M = 6.4e6, 1e9


def orbit_through(
    t_s: np.ndarray, position_eci_m: np.ndarray, *, start: float, stop: float, file: Path
) -> SampledOrbit:
    """Returns the orbit from `start` to `stop` [s] through positions [n 3] of date [m].

    Of close positions one a minute is used, joined by a spline of degree five, so that their rounding does not become
    speed; a hole of 20 minutes costs 0.7 km in a low orbit, half an hour 8 km. Before the first and after the last the
    orbit goes on as Kepler's. Raises `InputError` for fewer than six positions a minute apart, a hole beyond half an
    hour, a first or last position more than that away, a position within the Earth.
    """
    radius = np.linalg.norm(position_eci_m, axis=1)
    bad = np.flatnonzero(~((radius > _LOWEST_M) & (radius < _HIGHEST_M)))
    if bad.size:
        found = f"{radius[bad[0]] / 1e3:.6g} km at {t_s[bad[0]]:g} s"
        reason = f"expected positions beyond the Earth, found {found}; is the unit right?"
        raise InputError(reason, file=file, field="orbit.columns")
    minutes = np.arange(t_s[0], t_s[-1] + 0.5 * _SPACING_S, _SPACING_S)
    used = np.unique(np.searchsorted(t_s, minutes).clip(0, t_s.size - 1))
    t, position = t_s[used], position_eci_m[used]
    if t.size <= _DEGREE:
        reason = f"expected at least {_DEGREE + 1} positions a minute apart, found {t.size}"
        raise InputError(reason, file=file, field="orbit.columns")
    hole = float(max(np.max(np.diff(t)), t[0] - start, stop - t[-1]))
    if hole > _LARGEST_HOLE_S:
        raise InputError(f"positions have a hole of {hole:.0f} s", file=file, field="orbit.columns")
    spline = make_interp_spline(t, position, k=_DEGREE)
    speed = spline.derivative()
    count = few_sizes(max(math.ceil((stop - start) / _STEP_S), _DEGREE), LEAST_INTERVALS)
    grid = np.linspace(start, stop, count + 1)
    inside = np.clip(grid, t[0], t[-1])
    position, velocity = _flown(spline(inside), speed(inside), grid - inside)
    return SampledOrbit(start, (stop - start) / count, position, velocity)


def _flown(position: np.ndarray, velocity: np.ndarray, away: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States later or earlier by `away` [s] about a point mass, by Runge and Kutta's method in steps of 30 s."""
    steps = max(math.ceil(float(np.max(np.abs(away))) / _STEP_S), 1)
    h = (away / steps)[:, None]

    def slope(state):
        r, v = state
        return np.stack([v, -EARTH_MU * r / np.linalg.norm(r, axis=1, keepdims=True) ** 3])

    state = np.stack([position, velocity])
    for _ in range(steps):
        k1 = slope(state)
        k2 = slope(state + 0.5 * h * k1)
        k3 = slope(state + 0.5 * h * k2)
        k4 = slope(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state[0], state[1]
