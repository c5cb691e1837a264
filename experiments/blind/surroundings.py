"""Orbit, Sun, magnetic field and light of the Earth around a satellite, in NumPy and without `jaxsat`.

Kepler's orbit; Sun and Greenwich angle from ERFA; IGRF from ppigrf; cylinder shadow; mirror sphere (Penkov et al. 2009,
section 3.5, in the limit of small polygons); Lambert sphere summed over equal patches of its surface. SI, equatorial
axes of date.
"""

import datetime as dt

import erfa
import numpy as np
import ppigrf
from numpy.typing import NDArray

Array = NDArray[np.float64]

MU = 3.986004415e14
"""Of the Earth [m3/s2]."""
EARTH_RADIUS = 6371.2e3
"""Of shadow and albedo [m]."""
EARTH_RATE = 7.292115855e-5
"""Of the Greenwich angle [rad/s]."""
LEAP_SECONDS = 32.0
"""TAI - UTC from 1999 to 2005 [s]; UT1 is taken as UTC, less than 0.3 s from it in 2000-2002."""
SPEED_OF_LIGHT_AU_DAY = 173.144632674
PATCHES = (48, 160)
"""Of the visible cap, from its centre to the limb and around."""


def kepler(elements: dict[str, float], t: Array) -> tuple[Array, Array]:
    """[time 3] position [m] and velocity [m/s]; elements as in the truth files: a and t_peri in m and s, angles deg."""
    a, e = elements["a"], elements["e"]
    rate = np.sqrt(MU / a**3)
    mean = rate * (t - elements["t_peri"])
    ecc = mean + e * np.sin(mean)
    for _ in range(20):
        ecc = ecc - (ecc - e * np.sin(ecc) - mean) / (1.0 - e * np.cos(ecc))
    flat = np.sqrt(1.0 - e**2)
    ecc_rate = rate / (1.0 - e * np.cos(ecc))
    plane = a * np.stack([np.cos(ecc) - e, flat * np.sin(ecc)], axis=-1)
    speed = a * np.stack([-np.sin(ecc) * ecc_rate, flat * np.cos(ecc) * ecc_rate], axis=-1)
    node, tilt, perigee = np.radians([elements["raan"], elements["i"], elements["argp"]])
    axes = _turn(2, node) @ _turn(0, tilt) @ _turn(2, perigee)
    return plane @ axes[:, :2].T, speed @ axes[:, :2].T


def _turn(axis: int, angle: float) -> Array:
    """Matrix of the rotation by `angle` about a coordinate axis."""
    return np.asarray(erfa.rx(-angle, np.eye(3)) if axis == 0 else erfa.rz(-angle, np.eye(3)))


def _terrestrial(start: dt.datetime, t: Array) -> tuple[float, Array]:
    """Two-part Julian date, TT."""
    day, part = erfa.cal2jd(start.year, start.month, start.day)
    seconds = (start - dt.datetime(start.year, start.month, start.day)).total_seconds()
    return float(day + part), (seconds + t + LEAP_SECONDS + 32.184) / 86400.0


def apparent_sun(start: dt.datetime, t: Array) -> Array:
    """[time 3] unit vectors to the apparent Sun, true equator and equinox of date."""
    day, part = _terrestrial(start, t)
    heliocentric, barycentric = erfa.epv00(day, part)
    direction = -np.asarray(heliocentric["p"])
    distance = np.linalg.norm(direction, axis=-1, keepdims=True)
    # The Sun itself moves by less than a milliarcsecond in eight minutes: only the Earth's velocity matters.
    aberrated = direction / distance + np.asarray(barycentric["v"]) / SPEED_OF_LIGHT_AU_DAY
    of_date = np.einsum("tij,tj->ti", np.asarray(erfa.pnm06a(day, part)), aberrated)
    return of_date / np.linalg.norm(of_date, axis=-1, keepdims=True)


def greenwich_angle(start: dt.datetime) -> float:
    """Greenwich apparent sidereal time at t = 0 [rad]."""
    day, part = _terrestrial(start, np.zeros(1))
    universal = part - (LEAP_SECONDS + 32.184) / 86400.0
    return float(np.asarray(erfa.gst06a(day, universal, day, part)).item())


def magnetic_field(position: Array, start: dt.datetime, t: Array, greenwich: float) -> Array:
    """[time 3] field at [time 3] inertial positions [T]."""
    r = np.linalg.norm(position, axis=-1)
    colatitude = np.arccos(position[:, 2] / r)
    right_ascension = np.arctan2(position[:, 1], position[:, 0])
    longitude = np.degrees(right_ascension - greenwich - EARTH_RATE * t) % 360.0
    up, south, east = (
        np.squeeze(component, axis=0) for component in ppigrf.igrf_gc(r / 1e3, np.degrees(colatitude), longitude, start)
    )
    st, ct = np.sin(colatitude), np.cos(colatitude)
    sa, ca = np.sin(right_ascension), np.cos(right_ascension)
    radial = np.stack([st * ca, st * sa, ct], axis=-1)
    southward = np.stack([ct * ca, ct * sa, -st], axis=-1)
    eastward = np.stack([-sa, ca, np.zeros_like(sa)], axis=-1)
    return 1e-9 * (up[:, None] * radial + south[:, None] * southward + east[:, None] * eastward)


def is_lit(position: Array, sun: Array) -> NDArray[np.bool_]:
    """[time] whether outside the cylinder behind the Earth."""
    along = np.sum(position * sun, axis=-1)
    across = np.linalg.norm(position - along[:, None] * sun, axis=-1)
    return (along > 0.0) | (across > EARTH_RADIUS)


def mirrored(position: Array, sun: Array) -> tuple[Array, Array]:
    """[time 3] directions from the satellite to the Sun's image in a mirror sphere, [time] its light over the Sun's."""
    r = np.linalg.norm(position, axis=-1)
    up = position / r[:, None]
    across = np.cross(up, sun)
    sine = np.linalg.norm(across, axis=-1)
    alpha = np.arctan2(sine, np.sum(up * sun, axis=-1))
    low, high = 0.5 * alpha, alpha.copy()
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = r / EARTH_RADIUS * np.sin(2.0 * middle - alpha) > np.sin(middle)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    theta = 0.5 * (low + high)
    # The point lies in the plane of Sun and satellite, theta from the Sun.
    beside = np.cross(across / sine[:, None], sun)
    point = EARTH_RADIUS * (np.cos(theta)[:, None] * sun - np.sin(theta)[:, None] * beside)
    to_point = point - position
    rho = np.linalg.norm(to_point, axis=-1)
    visible = theta < 0.5 * np.pi
    cosine = np.where(visible, np.cos(theta), 1.0)
    factor = 1.0 / ((1.0 + 2.0 * rho / (EARTH_RADIUS * cosine)) * (1.0 + 2.0 * rho * cosine / EARTH_RADIUS))
    return to_point / rho[:, None], np.where(visible, factor, 0.0)


def scattered(position: Array, sun: Array, normals: Array) -> Array:
    """[time panels] light of a Lambert sphere of reflectivity one over the Sun's, normals [time panels 3].

    The sum over patches of  mu_sun mu_view max(0, n . d) dA / (pi distance^2)  over the visible, lit cap.
    """
    rings, spokes = PATCHES
    azimuth = 2.0 * np.pi * (np.arange(spokes) + 0.5) / spokes
    result = np.zeros(normals.shape[:2])
    for k, (r_vector, s, n) in enumerate(zip(position, sun, normals, strict=True)):
        r = np.linalg.norm(r_vector)
        up = r_vector / r
        side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
        side /= np.linalg.norm(side)
        share = (np.arange(rings) + 0.5) / rings
        limb = np.arccos(EARTH_RADIUS / r)
        central = limb * share
        area = EARTH_RADIUS**2 * np.sin(central) * (limb / rings) * (2.0 * np.pi / spokes)
        ring = np.sin(central)[:, None, None] * (
            np.cos(azimuth)[:, None] * side + np.sin(azimuth)[:, None] * np.cross(up, side)
        )
        outward = (ring + (np.cos(central)[:, None, None] * up)).reshape(-1, 3)
        to_patch = EARTH_RADIUS * outward - r_vector
        distance = np.linalg.norm(to_patch, axis=-1)
        to_patch /= distance[:, None]
        mu_sun = np.maximum(outward @ s, 0.0)
        mu_view = np.maximum(-np.sum(outward * to_patch, axis=-1), 0.0)
        weight = np.repeat(area, spokes) * mu_sun * mu_view / (np.pi * distance**2)
        result[k] = np.maximum(n @ to_patch.T, 0.0) @ weight
    return result
