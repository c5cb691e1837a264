"""The apparent direction of the Sun: a NumPy edge on ERFA, evaluated before anything is traced."""

import erfa
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from jaxsat.constants import AU
from jaxsat.time import SECONDS_PER_DAY, Epoch

_GRID_STEP_S = 1800.0
_LIGHT_DAYS_PER_AU = 499.00478383615643 / SECONDS_PER_DAY


def apparent_sun(epoch: Epoch, t_s: Float[np.ndarray, "n"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Return the unit vector to the Sun, true equator and equinox of date, and its distance [m], `t_s` after epoch.

    Apparent place of the Sun's centre seen from the Earth's: light time, aberration by the Earth's velocity, frame
    bias, precession and nutation IAU 2006/2000A (Urban & Seidelmann 2013, section 7.2; ERFA epv00, ab, pnm06a).
    Computed every half an hour and joined by a cubic spline, whose error is below 1e-12; parallax within the orbit
    of a satellite (0.003 deg at 8000 km) is left out.
    """
    t_s = np.asarray(t_s, float)
    if t_s.size == 0:
        return np.zeros((0, 3)), np.zeros(0)
    start, end = float(np.min(t_s)), float(np.max(t_s))
    grid = np.linspace(start, max(end, start + 1.0), max(4, 2 + int((end - start) / _GRID_STEP_S)))
    place = CubicSpline(grid, _apparent_place(epoch, grid))(t_s)
    distance = np.linalg.norm(place, axis=1)
    return place / distance[:, None], distance


def _apparent_place(epoch: Epoch, t_s: np.ndarray) -> np.ndarray:
    """Apparent geocentric vector of the Sun [m], true equator and equinox of date, [n, 3]."""
    tt1, tt2 = epoch.tt()
    tt2 = tt2 + t_s / SECONDS_PER_DAY
    # TT stands for TDB: they differ by less than 2 ms.
    earth_from_sun, earth = erfa.epv00(tt1, tt2)
    light_days = np.linalg.norm(earth_from_sun["p"], axis=1) * _LIGHT_DAYS_PER_AU
    then_from_sun, then = erfa.epv00(tt1, tt2 - light_days)
    sun_now = then["p"] - then_from_sun["p"] - earth["p"]
    distance = np.linalg.norm(sun_now, axis=1)
    # Earth's velocity in units of the speed of light; the Sun's own potential is left out with distance 1e9 AU.
    velocity = earth["v"] * _LIGHT_DAYS_PER_AU
    root = np.sqrt(1.0 - np.sum(velocity**2, axis=1))
    direction = erfa.ab(sun_now / distance[:, None], velocity, np.full(t_s.shape, 1e9), root)
    return np.einsum("nij,nj->ni", erfa.pnm06a(tt1, tt2), direction) * (distance * AU)[:, None]
