"""How far skCUBE is behind VZLUSAT-1, whose element set it borrows: by when its frames can have been heard at all."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sgp4.api import Satrec

from experiments.flight.skcube_files import ADCS, POWER
from jaxsat.constants import EARTH_RADIUS_MEAN, EARTH_ROTATION_RATE
from jaxsat.environment import sgp4_orbit, sun_directions
from jaxsat.time import Epoch, greenwich_angle

STATION_DEG = (48.3, 17.3)
"""Latitude and longitude of OM3KAA, near Bratislava, to some tenths of a degree."""
TRIED_S = np.arange(100.0, 241.0, 5.0)
DAY = Epoch.from_iso("2017-06-28T00:00:00Z")
UNIX_DAY = 1498608000
"""The same instant."""


@dataclass(frozen=True)
class Behind:
    """What speaks for how far it is behind."""

    lowest_deg: np.ndarray
    """[tried] lowest elevation of all frames of the day."""
    out_of_shadow_s: np.ndarray
    """[tried passes] from the end of the shadow to the first power frame."""

    @property
    def best_s(self) -> float:
        """By the horizon alone."""
        return float(TRIED_S[np.argmax(self.lowest_deg)])

    @property
    def possible_s(self) -> tuple[float, float]:
        """Ends of what has no frame lower than a degree below the best."""
        good = TRIED_S[self.lowest_deg > self.lowest_deg.max() - 1.0]
        return float(good[0]), float(good[-1])


def behind(data: Path, lines: tuple[str, str], evenings: list[int]) -> Behind:
    """Tries all delays; `evenings` are Unix times of the first power frames after the shadow."""
    stamps = []
    for name in (ADCS, POWER):
        with (data / name).open(encoding="utf-8", newline="") as stream:
            stamps += [int(row["t_rx"]) - UNIX_DAY for row in csv.DictReader(stream)]
    t = np.unique([stamp for stamp in stamps if 0 <= stamp < 86400]).astype(float)
    orbit = sgp4_orbit(Satrec.twoline2rv(*lines), DAY, start=-600.0, stop=87000.0)
    lowest = [float(_elevation(orbit, t, late).min()) for late in TRIED_S]
    waits = [[_since_shadow(orbit, first - UNIX_DAY, late) for first in evenings] for late in TRIED_S]
    return Behind(np.array(lowest), np.array(waits))


def _elevation(orbit, t: np.ndarray, late: float) -> np.ndarray:
    """[deg] of the satellite as the station has it, on a round Earth."""
    latitude, longitude = np.radians(STATION_DEG)
    angle = greenwich_angle(DAY) + EARTH_ROTATION_RATE * t + longitude
    up = np.stack(
        [np.cos(latitude) * np.cos(angle), np.cos(latitude) * np.sin(angle), np.full(len(t), np.sin(latitude))], axis=1
    )
    away = _positions(orbit, t - late) - EARTH_RADIUS_MEAN * up
    return np.degrees(np.arcsin(np.einsum("ni,ni->n", away, up) / np.linalg.norm(away, axis=1)))


def _since_shadow(orbit, first: float, late: float) -> float:
    """Seconds from the end of the Earth's shadow, a cylinder, to a time; not a number where it ended long before."""
    t = first + np.arange(-900.0, 300.0)
    r, sun = _positions(orbit, t - late), np.asarray(sun_directions(DAY, t))
    along = np.einsum("ni,ni->n", r, sun)
    dark = (along < 0.0) & (np.linalg.norm(r - along[:, None] * sun, axis=1) < EARTH_RADIUS_MEAN)
    return float(first - t[np.flatnonzero(dark)[-1]]) if dark.any() else np.nan


def _positions(orbit, t: np.ndarray) -> np.ndarray:
    import jax

    return np.asarray(jax.vmap(lambda time: orbit(time)[0])(t))
