"""What sensors see by themselves, sample by sample: known directions, attitudes, rates; and attitudes made of them."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.assembly import Samples
from fitting.measurements.sensed import SensedProblem

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
        """[samples 4] attitudes of all directions at once, NaN where fewer than two differ, and their 1-sigma [rad].

        Least squares of Wahba 1965 by the singular values of Markley 1988.
        """
        n = len(self.t)
        profile, weight_sum = np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
        count = np.zeros(n, int)
        for seen in self.directions:
            good = np.isfinite(seen.body).all(axis=1)
            weight = np.where(good, 1.0 / (np.nan_to_num(seen.sigma, nan=1.0) ** 2 + MODEL_ERROR**2), 0.0)
            body, inertial = np.nan_to_num(seen.body), seen.inertial
            profile += weight[:, None, None] * inertial[:, :, None] * body[:, None, :]
            across = np.eye(3) - inertial[:, :, None] * inertial[:, None, :]
            weight_sum += weight[:, None, None] * across
            count += good
        u, _, vt = np.linalg.svd(profile)
        sign = np.linalg.det(u) * np.linalg.det(vt)
        u[:, :, 2] *= sign[:, None]
        found = Rotation.from_matrix(u @ vt).as_quat(scalar_first=True)
        least = np.linalg.eigvalsh(weight_sum)[:, 0]
        sigma = np.where((count > 1) & (least > 0), 1.0 / np.sqrt(np.maximum(least, 1e-12)), np.inf)
        found[~(sigma < np.radians(40.0))] = np.nan
        tracked = np.isfinite(self.attitude).all(axis=1)
        found[tracked], sigma[tracked] = self.attitude[tracked], 1e-3
        return found, sigma


def triad(body: np.ndarray, inertial: np.ndarray) -> np.ndarray:
    """[n 4] attitudes, inertial from body, of two directions each [n 2 3], the first one kept exactly (Black 1964)."""

    def axes(pair):
        first = pair[:, 0] / np.linalg.norm(pair[:, 0], axis=1, keepdims=True)
        across = np.cross(first, pair[:, 1])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        return np.stack([first, across, np.cross(first, across)], axis=2)

    return Rotation.from_matrix(axes(inertial) @ np.swapaxes(axes(body), 1, 2)).as_quat(scalar_first=True)


def sights_of(problem: SensedProblem, samples: Samples) -> Sights:
    """Sights at the samples, by the calibrations of the problem's model; carried between a sensor's readings."""
    n, t = len(samples.t), samples.t
    known = {
        "field": np.asarray(problem.sky.b_field_eci)[:n],
        "nadir": -np.asarray(problem.sky.position_eci)[:n],
        "sun": np.zeros((n, 3)) if problem.sky.light is None else np.asarray(problem.sky.light.sun_eci)[:n],
    }
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
            rate, rate_sigma = _carried(t, vectors, unit=False), np.full(n, float(np.nanmedian(sigma)))
        else:
            # A bad reading among good ones would lead the whole search astray: a median of three times leaves it out.
            inertial = known[sensor.sees]
            inertial = inertial / np.maximum(np.linalg.norm(inertial, axis=1, keepdims=True), 1e-30)
            carried = _carried(t, vectors, unit=True)
            directions.append(Directions(carried, inertial, np.full(n, float(np.nanmedian(sigma)))))
    return Sights(t, tuple(directions), attitude, rate, rate_sigma)


def _carried(t: np.ndarray, vectors: np.ndarray, *, unit: bool) -> np.ndarray:
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
