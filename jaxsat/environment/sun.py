"""The apparent Sun: from ERFA before anything is traced, or from a series of trigonometric terms within a trace."""

from collections.abc import Sequence

import equinox as eqx
import erfa
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline

from jaxsat.constants import AU
from jaxsat.environment.orbit.abstract import AbstractOrbit
from jaxsat.frames import dcm_eci_from_ecliptic, dcms_eci_from_gcrf
from jaxsat.math import float_array
from jaxsat.time import DAYS_PER_CENTURY, SECONDS_PER_DAY, Epoch

_GRID_STEP_S = 1800.0
_LIGHT_DAYS_PER_AU = 499.00478383615643 / SECONDS_PER_DAY


def apparent_sun(epoch: Epoch, t_s: Float[np.ndarray, "n"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Return the unit vector to the Sun, true equator and equinox of date, and its distance [m], `t_s` after epoch.

    Apparent place of the Sun's centre seen from the Earth's: light time, aberration by the Earth's velocity, frame
    bias, precession and nutation IAU 2006/2000A (Urban & Seidelmann 2013, section 7.2; ERFA epv00, ab, pnm06a).
    Where instants are many they are joined by cubic splines, see `dcms_eci_from_gcrf`; parallax within the orbit of a
    satellite (0.003 deg at 8000 km) is left out.
    """
    t_s = np.asarray(t_s, float)
    place = np.einsum("nij,nj->ni", dcms_eci_from_gcrf(epoch, t_s), apparent_place_gcrf(epoch, t_s))
    distance = np.linalg.norm(place, axis=1)
    return place / distance[:, None], distance


def sun_directions(
    epoch: Epoch, t_s: Float[np.ndarray, "n"], *, fixed: Sequence[float] | None = None
) -> Float[np.ndarray, "n 3"]:
    """Return unit vectors to the Sun at `t_s` [s] after epoch: those of `apparent_sun`, or one direction held fixed."""
    if fixed is None:
        return apparent_sun(epoch, t_s)[0]
    direction = np.array(fixed)
    return np.tile(direction / np.linalg.norm(direction), (len(t_s), 1))


def apparent_place_gcrf(epoch: Epoch, t_s: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
    """Return the vector to the Sun [m] of `apparent_sun` in the axes of the GCRF; half-hours are joined by a spline."""
    start, end = (float(np.min(t_s)), float(np.max(t_s))) if t_s.size else (0.0, 0.0)
    nodes = max(4, 2 + int((end - start) / _GRID_STEP_S))
    if t_s.size <= nodes:
        return _apparent_place(epoch, t_s)
    grid = np.linspace(start, max(end, start + 1.0), nodes)
    return CubicSpline(grid, _apparent_place(epoch, grid))(t_s)


def _apparent_place(epoch: Epoch, t_s: np.ndarray) -> np.ndarray:
    tt1, tt2 = epoch.tt()
    tt2 = tt2 + t_s / SECONDS_PER_DAY
    # TT stands for TDB: they differ by less than 2 ms.
    earth_from_sun, earth = erfa.epv00(tt1, tt2)
    light_days = np.linalg.norm(earth_from_sun["p"], axis=1) * _LIGHT_DAYS_PER_AU
    # Light left the Sun from where it was: back along its own motion about the barycentre, straight to a centimetre.
    sun_now = -earth_from_sun["p"] - light_days[:, None] * (earth["v"] - earth_from_sun["v"])
    distance = np.linalg.norm(sun_now, axis=1)
    # Earth's velocity in units of the speed of light; the Sun's own potential is left out with distance 1e9 AU.
    velocity = earth["v"] * _LIGHT_DAYS_PER_AU
    root = np.sqrt(1.0 - np.sum(velocity**2, axis=1))
    direction = erfa.ab(sun_now / distance[:, None], velocity, np.full(t_s.shape, 1e9), root)
    return direction * (distance * AU)[:, None]


def _terms(*texts: str) -> tuple[np.ndarray, ...]:
    """Tables of amplitude, phase and frequency, one for each power of time."""
    return tuple(np.array(text.split(), float).reshape(-1, 3) * [1e-8, 1.0, 1.0] for text in texts)


# A [1e-8 rad or au], B [rad] and C [rad a Julian millennium] of the sums A cos(B + C t), times 1, t, t^2: the Earth in
# VSOP87D (Bretagnon & Francou 1988), as abridged by Meeus 1998, appendix III. Terms from 1e-6, in latitude from 3e-7.
_LONGITUDE = _terms(
    """
    175347046  0        0           3341656 4.6692568  6283.07585  34894 4.62610 12566.1517
         3497  2.7441   5753.3849      3418 2.8289        3.5231    3136 3.6277  77713.7715
         2676  4.4181   7860.4194      2343 6.1352     3930.2097    1324 0.7425  11506.7698
         1273  2.0371    529.6910      1199 1.1096     1577.3435     990 5.233    5884.927
          902  2.045      26.298        857 3.508       398.149      780 1.179    5223.694
          753  2.533    5507.553        505 4.583     18849.228      492 4.205     775.523
          357  2.920       0.067        317 5.849     11790.629      284 1.899     796.298
          271  0.315   10977.079        243 0.345      5486.778      206 4.806    2544.314
          205  1.869    5573.143        202 2.458      6069.777      156 0.833     213.299
          132  3.411    2942.463        126 1.083        20.775      115 0.645       0.980
          103  0.636    4694.003        102 0.976     15720.839      102 4.267       7.114
    """,
    """
    628331966747 0     0        206059 2.678235 6283.07585  4303 2.6351 12566.1517
             425 1.590 3.523       119 5.796      26.298     109 2.966   1577.344
    """,
    "52919 0 0  8720 1.0721 6283.0758  309 0.867 12566.152",
)
_LATITUDE = _terms("280 3.199 84334.662  102 5.422 5507.553  80 3.88 5223.69  44 3.70 2352.87  32 4.00 1577.34")
_DISTANCE = _terms(
    """
    100013989 0      0           1670700 3.0984635 6283.07585  13956 3.05525 12566.1517
         3084 5.1985 77713.7715     1628 1.1739    5753.3849    1576 2.8469   7860.4194
          925 5.453  11506.770       542 4.564     3930.210      472 3.661    5884.927
          346 0.964   5507.553       329 5.900     5223.694      307 0.299    5573.143
          243 4.273  11790.629       212 5.847     1577.344      186 5.022   10977.079
          175 3.012  18849.228       110 5.055     5486.778
    """,
    "103019 1.10749 6283.07585  1721 1.0644 12566.1517  702 3.142 0",
    "4359 5.7846 6283.0758",
)
_ARCSECOND = np.pi / 648000.0
_TO_FK5 = -0.09033 * _ARCSECOND
_ABERRATION = -20.4898 * _ARCSECOND


def sun_position(t_centuries: Float[Array, ""]) -> Float[Array, "3"]:
    """Return the apparent place of the Sun [m], true equator and equinox of date, by TT Julian centuries since J2000.

    VSOP87 with aberration and nutation (Meeus 1998, chapter 25, higher accuracy). Against `apparent_sun` over
    1990-2030: within 0.0007 deg and 1e-5 of the distance. Float32 rounds the time argument to minutes and the phases
    with it: within 0.003 deg.
    """
    millennia = 0.1 * t_centuries
    distance = _series(_DISTANCE, millennia)
    longitude = _series(_LONGITUDE, millennia) + np.pi + _TO_FK5 + _ABERRATION / distance
    latitude = -_series(_LATITUDE, millennia)
    across = jnp.cos(latitude)
    direction = jnp.stack([across * jnp.cos(longitude), across * jnp.sin(longitude), jnp.sin(latitude)])
    return distance * AU * jnp.matmul(dcm_eci_from_ecliptic(t_centuries), direction, precision="highest")


def sun_direction(t_centuries: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, ""]]:
    """Return the unit vector to the apparent Sun and its distance [m]; see `sun_position`."""
    place = sun_position(t_centuries)
    distance = jnp.linalg.norm(place)
    return place / distance, distance


class Sun(AbstractOrbit):
    """The apparent Sun about the Earth from the series of `sun_position`, traced: `Sun(epoch.tt_centuries())`."""

    centuries: Float[Array, ""] = eqx.field(converter=float_array)
    """TT at t = 0, Julian centuries since J2000."""

    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Return position [m] and velocity [m/s], true equator and equinox of date, `t` seconds after the epoch."""
        return jax.jvp(lambda t: sun_position(self._centuries_at(t)), (t,), (jnp.ones_like(t),))

    def direction(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, ""]]:
        """Return the unit vector to the Sun and its distance [m], `t` seconds after the epoch."""
        return sun_direction(self._centuries_at(t))

    def check_span(self, times: np.ndarray) -> None:
        """Accept any times: the series are as good over 1900-2100."""

    def _centuries_at(self, t: Float[Array, ""]) -> Float[Array, ""]:
        return self.centuries + t / (SECONDS_PER_DAY * DAYS_PER_CENTURY)


def _series(tables: tuple[np.ndarray, ...], t: Float[Array, ""]) -> Float[Array, ""]:
    """Sum over powers k of t^k sum A cos(B + C t)."""
    total = jnp.zeros_like(t)
    for table in reversed(tables):
        amplitude, phase, frequency = jnp.asarray(table.T, t.dtype)
        total = total * t + jnp.sum(amplitude * jnp.cos(phase + frequency * t))
    return total
