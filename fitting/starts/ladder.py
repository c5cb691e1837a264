"""First guesses of attitude and rate from what the sensors see: two directions, one of them, or none.

A ladder: an attitude where a sample has two directions, else one direction and any roll about it, else any attitude;
rates by a gyroscope, else by finite turns between close samples, else any in a ball.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.abstract import RATE_UNIT
from fitting.parameters.names import STATE
from fitting.starts.multi_start import Starts
from fitting.starts.sights import Sights

WINDOW = 8
"""Samples with a sight from which the first attitudes and rates are taken."""
OFF = np.radians(25.0)
"""By which some of the first attitudes are turned off about each axis."""
GYRO_ERROR = np.radians(0.2)
"""By which rates about that of a gyroscope are spread at least, for its bias [rad/s]."""


@dataclass(frozen=True)
class Guesses:
    """Attitudes and rates at one instant."""

    attitude: np.ndarray
    """[starts 4]"""
    rate: np.ndarray
    """[starts 3] body axes [rad/s]."""

    def starts(self, unknowns: np.ndarray) -> Starts:
        """As points of a solver whose other unknowns are these, 0 where they are nominal."""
        x = np.tile(unknowns, (len(self.attitude), 1))
        x[:, 3 : len(STATE)] = self.rate / RATE_UNIT
        return Starts(x, self.attitude, np.zeros(len(x)))


def telling_samples(sights: Sights) -> np.ndarray:
    """Numbers of the samples at which an attitude, or else a direction, is seen; all where none is."""
    attitude, _ = sights.wahba()
    both = np.isfinite(attitude).all(axis=1)
    if both.sum() >= WINDOW:
        return np.flatnonzero(both)
    seen = np.zeros(len(sights.t), bool)
    for directions in sights.directions:
        seen |= np.isfinite(directions.body).all(axis=1)
    return np.flatnonzero(seen) if seen.sum() >= WINDOW else np.arange(len(sights.t))


def directed_samples(sights: Sights) -> np.ndarray:
    """Numbers of the samples at which any direction or an attitude is seen; all where none is."""
    seen = np.isfinite(sights.attitude).all(axis=1)
    for directions in sights.directions:
        seen |= np.isfinite(directions.body).all(axis=1)
    return np.flatnonzero(seen) if seen.sum() >= WINDOW else np.arange(len(sights.t))


def first_guesses(sights: Sights, begin: int, count: int, max_rate: float, rng: np.random.Generator) -> Guesses:
    """About `count` attitudes and rates at sample number `begin`; `max_rate` is the radius of the ball [rad/s]."""
    attitude, _ = sights.wahba()
    near = np.flatnonzero(np.isfinite(attitude).all(axis=1) & (np.arange(len(sights.t)) >= begin))[: 2 * WINDOW]
    if len(near) >= 3:
        return _from_attitudes(sights, attitude, near, begin, count, rng)
    for directions in sights.directions:
        good = np.flatnonzero(np.isfinite(directions.body).all(axis=1) & (np.arange(len(sights.t)) >= begin))
        if len(good):
            return _about_direction(sights, directions, good[:WINDOW], begin, count, max_rate, rng)
    attitude = Rotation.random(count, rng=rng).as_quat(scalar_first=True)
    return Guesses(attitude, _rates(sights, begin, count, max_rate, rng))


def finite_turn_rates(t: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """[n-1 3] body rates by the shorter turn from each attitude [n 4] to the next [rad/s]."""
    turns = Rotation.from_quat(attitude, scalar_first=True)
    return (turns[:-1].inv() * turns[1:]).as_rotvec() / np.diff(t)[:, None]


def _from_attitudes(sights, attitude, near, begin, count, rng) -> Guesses:
    t, q = sights.t[near], attitude[near]
    gyro = sights.rate[near]
    if np.isfinite(gyro).all(axis=1).any():
        central = np.nanmedian(gyro[:3], axis=0)
        spread = GYRO_ERROR + float(np.nanmedian(sights.rate_sigma[near]))
        rates = np.vstack([central, gyro[np.isfinite(gyro).all(axis=1)]])
    else:
        turns = finite_turn_rates(t, q)
        central = np.median(turns, axis=0)
        # What consecutive turns differ by is their error, for the most part.
        spread = 0.7 * float(np.median(np.linalg.norm(turns - central, axis=1))) + 0.05 * np.linalg.norm(central)
        rates = np.vstack([central, np.median(turns[:4], axis=0), turns])
    more = rates[0] + spread * rng.normal(size=(max(count - len(rates), 0), 3))
    rate = np.vstack([rates, more])[:count]
    # Each attitude of the window, carried back to the beginning at the start's rate.
    number = np.arange(len(rate)) % len(near)
    back = Rotation.from_rotvec(-rate * (t[number] - sights.t[begin])[:, None])
    # Nominal calibrations may be far from the true ones: a turned sensor, late stamps of a fast spin.
    error = np.where(number % 2 == 0, 0.0, OFF) * (np.arange(len(rate)) >= len(rate) // 4)
    off = Rotation.from_rotvec(error[:, None] * rng.normal(size=(len(rate), 3)))
    return Guesses((Rotation.from_quat(q[number], scalar_first=True) * back * off).as_quat(scalar_first=True), rate)


def _about_direction(sights, directions, good, begin, count, max_rate, rng) -> Guesses:
    """The direction in its place, any roll about it."""
    first = good[0]
    body, inertial = directions.body[first], directions.inertial[first]
    turn = _shortest(body, inertial)
    roll = 2.0 * np.pi * (np.arange(count) + rng.uniform(size=count)) / count
    attitude = Rotation.from_rotvec(roll[:, None] * inertial) * turn
    rate = _rates(sights, begin, count, max_rate, rng)
    back = Rotation.from_rotvec(-rate * (sights.t[first] - sights.t[begin]))
    return Guesses((attitude * back).as_quat(scalar_first=True), rate)


def _rates(sights: Sights, begin: int, count: int, max_rate: float, rng: np.random.Generator) -> np.ndarray:
    """[count 3] rates about that of the gyroscope, or even in a ball, radii stratified."""
    known = np.flatnonzero(np.isfinite(sights.rate).all(axis=1))
    if len(known):
        place = known[np.argsort(np.abs(known - begin))[:3]]
        spread = GYRO_ERROR + float(sights.rate_sigma[place[0]])
        return np.median(sights.rate[place], axis=0) + spread * rng.normal(size=(count, 3))
    radius = max_rate * np.cbrt((rng.permutation(count) + rng.uniform(size=count)) / count)
    axis = rng.normal(size=(count, 3))
    return radius[:, None] * axis / np.linalg.norm(axis, axis=1, keepdims=True)


def _shortest(a: np.ndarray, b: np.ndarray) -> Rotation:
    """The shortest turn from one unit vector to another."""
    axis = np.cross(a, b)
    sine, cosine = np.linalg.norm(axis), float(a @ b)
    if sine < 1e-9:
        across = np.eye(3)[np.argmin(np.abs(a))]
        axis, sine = np.cross(a, across), np.linalg.norm(np.cross(a, across))
    return Rotation.from_rotvec(axis / sine * np.arctan2(np.linalg.norm(np.cross(a, b)), cosine))
