"""What surrounds a satellite: orbit, field, Sun and shadow, from `sgp4`, `ppigrf` and `erfa` and without `jaxsat`.

Inertial axes are the true equator and equinox of date. UT1 is taken as UTC, and the pole of the Earth as that of date.
"""

import datetime as dt
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import erfa
import numpy as np
import ppigrf
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from sgp4.api import Satrec

Array = NDArray[np.float64]

AU, LIGHT_TIME_AU = 149597870700.0, 499.004783836
"""Metres, and seconds of light over them."""
EARTH_RADIUS, SUN_RADIUS = 6371008.8, 6.957e8
"""[m]; the Earth that casts the shadow and scatters light is a sphere of her mean radius."""
NODE_S = 5.0
"""Cubic splines over it hold position and field of degree 13 to 1e-9 of themselves."""


@dataclass(frozen=True)
class World:
    """Surroundings of the satellite of one element set over a span of times [s] from an epoch (UTC)."""

    tle: tuple[str, str]
    epoch: dt.datetime
    start: float
    stop: float

    @cached_property
    def nodes(self) -> Array:
        """Times of the table [s], a little beyond both ends."""
        return np.arange(self.start - 2.0 * NODE_S, self.stop + 2.0 * NODE_S, NODE_S)

    def _utc(self, t: Any) -> tuple[float, Array]:
        at = self.epoch
        day, part = erfa.dtf2d("UTC", at.year, at.month, at.day, at.hour, at.minute, at.second + at.microsecond * 1e-6)
        return float(day), float(part) + np.asarray(t, float) / 86400.0

    def _tt(self, t: Any) -> tuple[Array, Array]:
        return erfa.taitt(*erfa.utctai(*self._utc(t)))

    def greenwich(self, t: Any) -> Array:
        """Apparent sidereal time [rad]."""
        return erfa.gst06a(*self._utc(t), *self._tt(t))

    @cached_property
    def of_date_from_gcrs(self) -> Array:
        """Rotation matrix of bias, precession and nutation at the epoch."""
        return erfa.pnm06a(*self._tt(0.0))

    @cached_property
    def positions(self) -> Array:
        """Of the satellite at the nodes [m], by SGP4, whose mean equinox is turned to the true one."""
        record = Satrec.twoline2rv(*self.tle)
        day, part = self._utc(self.nodes)
        error, teme, _ = record.sgp4_array(np.full(part.shape, day), part)
        if error.any():
            raise ValueError(f"sgp4 answers with error {error[error != 0][0]} for {self.tle[0][:8]}")
        turn = erfa.eqeq94(*self._tt(self.nodes))
        return 1e3 * about_pole(turn, teme)

    @cached_property
    def fields(self) -> Array:
        """Magnetic flux density at the nodes [T], inertial components, IGRF-14 of the epoch's day."""
        angle = self.greenwich(self.nodes)
        x, y, z = about_pole(-angle, self.positions).T
        radius, east = np.sqrt(x * x + y * y + z * z), np.arctan2(y, x)
        polar = np.arccos(z / radius)
        up, south, eastward = (
            component.ravel() * 1e-9
            for component in ppigrf.igrf_gc(radius * 1e-3, np.degrees(polar), np.degrees(east), self.epoch)
        )
        level = up * np.sin(polar) + south * np.cos(polar)
        fixed = np.stack(
            [
                level * np.cos(east) - eastward * np.sin(east),
                level * np.sin(east) + eastward * np.cos(east),
                up * np.cos(polar) - south * np.sin(polar),
            ],
            axis=1,
        )
        return about_pole(angle, fixed)

    @cached_property
    def spline(self) -> CubicSpline:
        """[6]: position [m] and field [T] over time [s]."""
        return CubicSpline(self.nodes, np.concatenate([self.positions, self.fields], axis=1))

    @cached_property
    def _track(self) -> CubicSpline:
        # Apart from the field, which costs a hundred times as much: orbits are tried for their shadow alone.
        return CubicSpline(self.nodes, self.positions)

    def position(self, t: Any) -> Array:
        """From the Earth's centre [... 3], m."""
        return self._track(t)

    def field(self, t: Any) -> Array:
        """Magnetic flux density [... 3], T."""
        return self.spline(t)[..., 3:]

    def sun(self, t: Any) -> tuple[Array, Array]:
        """Apparent direction of the Sun from the Earth's centre [... 3], and its distance [m]."""
        heliocentric, barycentric = erfa.epv00(*self._tt(t))
        natural = -heliocentric["p"]
        distance = np.linalg.norm(natural, axis=-1)
        velocity = barycentric["v"] * LIGHT_TIME_AU / 86400.0
        slow = np.sqrt(1.0 - np.sum(velocity**2, axis=-1))
        apparent = erfa.ab(natural / distance[..., None], velocity, distance, slow)
        return np.einsum("...ij,...j->...i", erfa.pnm06a(*self._tt(t)), apparent), distance * AU

    def illumination(self, t: Any) -> Array:
        """Share of the Sun's disk that the Earth leaves free, [...]."""
        direction, distance = self.sun(t)
        position = self.position(t)
        to_sun = direction * distance[..., None] - position
        away, radius = np.linalg.norm(to_sun, axis=-1), np.linalg.norm(position, axis=-1)
        cosine = -np.sum(to_sun * position, axis=-1) / (away * radius)
        return free_share(
            np.arcsin(SUN_RADIUS / away), np.arcsin(EARTH_RADIUS / radius), np.arccos(np.clip(cosine, -1.0, 1.0))
        )


def about_pole(angle: Array, vectors: Array) -> Array:
    """Vectors [n 3] turned by angles [n] about the third axis, counted eastward."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)


def free_share(sun: Array, earth: Array, apart: Array) -> Array:
    """Share of a disk of radius `sun` outside another of radius `earth`, centres `apart`, all angles small to 1 deg.

    The lens of two circles: a^2 acos((d^2 + a^2 - b^2) / 2da) + b^2 acos((d^2 + b^2 - a^2) / 2db) - kite.
    """
    d = np.maximum(apart, 1e-12)
    at_sun = np.clip((d * d + sun**2 - earth**2) / (2.0 * d * sun), -1.0, 1.0)
    at_earth = np.clip((d * d + earth**2 - sun**2) / (2.0 * d * earth), -1.0, 1.0)
    kite = (sun + earth - d) * (d + sun - earth) * (d - sun + earth) * (d + sun + earth)
    lens = sun**2 * np.arccos(at_sun) + earth**2 * np.arccos(at_earth) - 0.5 * np.sqrt(np.maximum(kite, 0.0))
    return np.clip(1.0 - lens / (np.pi * sun**2), 0.0, 1.0)
