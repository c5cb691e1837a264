"""Field and Sun along one orbit, by ppigrf and the almanac's formula: what sensors of made-up tables see."""

import numpy as np
import ppigrf
from scipy.spatial.transform import Rotation
from sgp4.api import Satrec

from jaxsat.time import Epoch, equinox_difference, greenwich_angle

TLE = (
    "1 99001U 21001A   20326.72226509  .00001924  00000-0  13588-3 0  9993",
    "2 99001  82.1924 107.1117 0028351 295.3535 124.0543 15.40668907    12",
)
EPOCH = Epoch.from_iso("2020-11-21T20:58:01Z")
T = np.arange(0.0, 5400.0, 20.0)


def surroundings():
    """Field [nT], and unit vectors to the Sun (to 0.01 deg), of date; by ppigrf and the almanac's formula."""
    satellite = Satrec.twoline2rv(*TLE)
    field = []
    for t in T:
        _, position, _ = satellite.sgp4(EPOCH.utc1, EPOCH.utc2 + t / 86400.0)
        now = EPOCH.shifted(float(t))
        x, y, z = Rotation.from_rotvec([0, 0, equinox_difference(now) - greenwich_angle(now)]).apply(position)
        r, theta, phi = np.hypot(np.hypot(x, y), z), np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
        date = np.datetime64("2020-11-21T20:58:01").astype(object)
        br, bt, bp = (float(np.squeeze(each)) for each in ppigrf.igrf_gc(r, np.degrees(theta), np.degrees(phi), date))
        c, s = np.cos(theta), np.sin(theta)
        ecef = Rotation.from_rotvec([0, 0, phi]).apply([br * s + bt * c, bp, br * c - bt * s])
        field.append(Rotation.from_rotvec([0, 0, greenwich_angle(now)]).apply(ecef))
    days = EPOCH.utc1 + EPOCH.utc2 - 2451545.0
    anomaly = np.radians(357.528 + 0.9856003 * days)
    longitude = np.radians(280.461 + 0.9856474 * days + 1.915 * np.sin(anomaly) + 0.02 * np.sin(2 * anomaly))
    obliquity = np.radians(23.439)
    sun = np.array([np.cos(longitude), np.cos(obliquity) * np.sin(longitude), np.sin(obliquity) * np.sin(longitude)])
    return np.array(field), np.tile(sun, (T.size, 1))


FIELD, SUN_ECI = surroundings()
