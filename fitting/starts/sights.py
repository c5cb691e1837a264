"""What sensors see by themselves, sample by sample: known directions, attitudes, rates; and attitudes made of them."""

from dataclasses import dataclass

import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from jaxsat.estimation import wahba

LONGEST_GAP = 2.5
"""A direction is carried between two readings that are less than so many usual intervals apart."""
LARGEST_TURN = np.radians(75.0)
"""And by less than this."""
MODEL_ERROR = np.radians(3.0)
"""What a nominal calibration is wrong by, at best."""


@dataclass(frozen=True)
class Directions:
    """One sensor's sight of a known direction at all samples; rows of NaN where it sees nothing."""

    body: np.ndarray
    """[samples 3] unit vectors, body axes."""
    inertial: np.ndarray
    """[samples 3]"""
    sigma: np.ndarray
    """[samples] 1-sigma of the angle [rad]."""


@dataclass(frozen=True)
class Sights:
    """What all sensors see at the samples of a problem."""

    t: np.ndarray
    directions: tuple[Directions, ...]
    attitude: np.ndarray
    """[samples 4] read off a star tracker, or NaN."""
    rate: np.ndarray
    """[samples 3] read off a gyroscope, or NaN [rad/s]."""
    rate_sigma: np.ndarray
    """[samples]"""

    def wahba(self) -> tuple[np.ndarray, np.ndarray]:
        """[samples 4] attitudes of all directions at once, NaN where fewer than two differ, and their 1-sigma [rad]."""
        found, sigma = np.full((len(self.t), 4), np.nan), np.full(len(self.t), np.inf)
        if self.directions:
            body = np.stack([seen.body for seen in self.directions], axis=1)
            inertial = np.stack([seen.inertial for seen in self.directions], axis=1)
            spread = np.hypot(np.stack([seen.sigma for seen in self.directions], axis=1), MODEL_ERROR)
            found, covariance = wahba(body, inertial, spread)
            told = np.isfinite(found).all(axis=1)
            sigma[told] = np.sqrt(np.linalg.eigvalsh(covariance[told])[:, 2])
        found[~(sigma < np.radians(40.0))] = np.nan
        tracked = np.isfinite(self.attitude).all(axis=1)
        found[tracked], sigma[tracked] = self.attitude[tracked], 1e-3
        return found, sigma


def sights_of(problem: Problem, samples: Samples) -> Sights:
    """Sights at the samples, by the calibrations of the problem's model; carried between a sensor's readings."""
    n, t = len(samples.t), samples.t
    known = known_directions(problem, n)
    directions, attitude = [], np.full((n, 4), np.nan)
    rate, rate_sigma = np.full((n, 3), np.nan), np.full(n, np.inf)
    for name, rows in samples.values.items():
        sensor, channel = problem.model.sensors[name], samples.channels[name]
        if sensor.sees is None or channel.witness:
            continue
        found = sensor.direct(rows, channel.sigma)
        if found is None or not np.isfinite(np.asarray(found[1])).any():
            continue
        vectors, sigma = (np.asarray(array, float) for array in found)
        if sensor.sees == "attitude":
            attitude = vectors
        elif sensor.sees == "rate":
            rate, rate_sigma = carried(t, vectors, unit=False), np.full(n, float(np.nanmedian(sigma)))
        else:
            spread = np.full(n, float(np.nanmedian(sigma)))
            directions.append(Directions(carried(t, vectors, unit=True), known[sensor.sees], spread))
    return Sights(t, tuple(directions), attitude, rate, rate_sigma)


def known_directions(problem: Problem, count: int) -> dict[str, np.ndarray]:
    """[count 3] unit vectors, inertial axes, of the field, the Sun (zero where there is no light) and the nadir."""
    light = problem.sky.light
    found = {
        "field": np.asarray(problem.sky.b_field_eci)[:count],
        "nadir": -np.asarray(problem.sky.position_eci)[:count],
        "sun": np.zeros((count, 3)) if light is None else np.asarray(light.sun_eci)[:count],
    }
    return {name: v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-30) for name, v in found.items()}


def carried(t: np.ndarray, vectors: np.ndarray, *, unit: bool) -> np.ndarray:
    """Vectors at all times: those measured, and between two near measurements what lies between them."""
    good = np.flatnonzero(np.isfinite(vectors).all(axis=1))
    found = vectors.copy()
    if len(good) < 2:
        return found
    longest = LONGEST_GAP * float(np.median(np.diff(t[good])))
    place = np.clip(np.searchsorted(t[good], t, side="right") - 1, 0, len(good) - 2)
    left, right = good[place], good[place + 1]
    share = np.clip((t - t[left]) / (t[right] - t[left]), 0.0, 1.0)[:, None]
    between = (1.0 - share) * vectors[left] + share * vectors[right]
    near = (t[right] - t[left] <= longest) & (t >= t[left]) & (t <= t[right])
    if unit:
        near &= np.einsum("ni,ni->n", vectors[left], vectors[right]) > np.cos(LARGEST_TURN)
        between /= np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-12)
    missing = ~np.isfinite(found).all(axis=1) & near
    found[missing] = between[missing]
    return found
