"""Where Sun, Moon and Greenwich are at given instants: apparent places of date, from ERFA before anything is traced."""

from dataclasses import dataclass

import erfa
import numpy as np
from jaxtyping import Float

from jaxsat.constants import AU
from jaxsat.environment.sun import apparent_place_gcrf
from jaxsat.frames import dcms_eci_from_gcrf
from jaxsat.time import SECONDS_PER_DAY, Epoch


@dataclass(frozen=True)
class Ephemeris:
    """Apparent places seen from the Earth's centre, true equator and equinox of date, and the Earth's turn."""

    sun_right_ascension: Float[np.ndarray, "n"]
    """[rad, 0..2 pi)"""
    sun_declination: Float[np.ndarray, "n"]
    """[rad]"""
    sun_distance: Float[np.ndarray, "n"]
    """[m]"""
    moon_right_ascension: Float[np.ndarray, "n"]
    """[rad, 0..2 pi)"""
    moon_declination: Float[np.ndarray, "n"]
    """[rad]"""
    moon_distance: Float[np.ndarray, "n"]
    """[m]"""
    greenwich_angle: Float[np.ndarray, "n"]
    """Greenwich apparent sidereal time [rad, 0..2 pi)."""


def ephemeris(epoch: Epoch, t_s: Float[np.ndarray, "n"], ut1_minus_utc: int | float = 0.0) -> Ephemeris:
    """Returns Sun, Moon and Greenwich `t_s` SI seconds after an epoch.

    The Sun is that of `apparent_sun`; the Moon ERFA's moon98, series of ELP-2000/82 with light time, within 10" of
    longitude, by precession and nutation IAU 2006/2000A; Greenwich is apparent sidereal time with UT1 - UTC [s] the
    same at all instants, in error by what that is where it is not given (0.004 deg at most).
    """
    t_s = np.asarray(t_s, float)
    of_date = dcms_eci_from_gcrf(epoch, t_s)
    sun, sun_distance = _of_date(of_date, apparent_place_gcrf(epoch, t_s))
    moon, moon_distance = _of_date(of_date, _moon_gcrf(epoch, t_s))
    return Ephemeris(
        *_right_ascension_and_declination(sun),
        sun_distance,
        *_right_ascension_and_declination(moon),
        moon_distance,
        sidereal_time(epoch, t_s, of_date, ut1_minus_utc),
    )


def sidereal_time(
    epoch: Epoch,
    t_s: Float[np.ndarray, "n"],
    dcm_of_date_from_gcrf: Float[np.ndarray, "n 3 3"],
    ut1_minus_utc: int | float = 0.0,
) -> Float[np.ndarray, "n"]:
    """Returns Greenwich apparent sidereal time [rad, 0..2 pi) `t_s` after an epoch, see `ephemeris`.

    With the matrices of `dcms_eci_from_gcrf` at hand it costs a fiftieth of `jaxsat.time.greenwich_angles`, which works
    out the same nutation.
    """
    tt1, tt2 = epoch.tt()
    ut1 = epoch.ut1_after(t_s, ut1_minus_utc)
    return erfa.gst06(*ut1, tt1, tt2 + t_s / SECONDS_PER_DAY, dcm_of_date_from_gcrf) % (2.0 * np.pi)


def apparent_moon(epoch: Epoch, t_s: Float[np.ndarray, "n"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Returns the unit vector to the Moon, true equator and equinox of date, and its distance [m], see `ephemeris`."""
    t_s = np.asarray(t_s, float)
    return _of_date(dcms_eci_from_gcrf(epoch, t_s), _moon_gcrf(epoch, t_s))


def _moon_gcrf(epoch: Epoch, t_s: np.ndarray) -> np.ndarray:
    tt1, tt2 = epoch.tt()
    return AU * erfa.moon98(tt1, tt2 + t_s / SECONDS_PER_DAY)["p"]


def _of_date(dcm: np.ndarray, place_gcrf: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors in the axes of date, and distances."""
    place = np.einsum("nij,nj->ni", dcm, place_gcrf)
    distance = np.linalg.norm(place, axis=1)
    return place / distance[:, None], distance


def _right_ascension_and_declination(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y, z = direction.T
    return np.arctan2(y, x) % (2.0 * np.pi), np.arctan2(z, np.hypot(x, y))
