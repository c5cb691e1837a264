"""A motion that is told beforehand, at any times: smooth between quaternions that follow each other, nowhere else."""

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

from fitting.measurements.problem import Motion

LONGEST_GAP = 2.5
"""Between two quaternions that are more usual intervals apart than this nobody knows how the satellite turned."""

Given = tuple[np.ndarray, np.ndarray]
"""Rising times [s] and quaternions [n 4], inertial from body, scalar first."""


def stretches(times: np.ndarray) -> list[slice]:
    """Places of quaternions that follow each other; those that stand alone are in none."""
    if len(times) < 2:
        return []
    steps = np.diff(times)
    ends = np.flatnonzero(steps > LONGEST_GAP * np.median(steps)) + 1
    bounds = np.concatenate([[0], ends, [len(times)]]).tolist()
    return [slice(a, b) for a, b in zip(bounds[:-1], bounds[1:], strict=True) if b - a > 1]


def is_told(given: Given, t: np.ndarray) -> np.ndarray:
    """[n] whether the motion is told at times [n]."""
    times, _ = given
    found = np.zeros(len(t), bool)
    for part in stretches(times):
        found |= (t >= times[part][0]) & (t <= times[part][-1])
    return found


def motion_at(given: Given, t: np.ndarray) -> Motion:
    """Attitude, rate and angular acceleration at rising times, each of which `is_told`.

    Cubic in the rotation vectors between the quaternions of a stretch (SciPy's `RotationSpline`).
    """
    times, quaternions = given
    found = [np.zeros((len(t), size)) for size in (4, 3, 3)]
    found[0][:, 0] = 1.0
    for part in stretches(times):
        here = np.flatnonzero((t >= times[part][0]) & (t <= times[part][-1]))
        if not len(here):
            continue
        spline = RotationSpline(times[part], Rotation.from_quat(quaternions[part], scalar_first=True))
        # Of rotations that take body vectors to inertial ones SciPy gives the rates in body axes.
        found[0][here] = spline(t[here]).as_quat(scalar_first=True)
        found[1][here], found[2][here] = spline(t[here], 1), spline(t[here], 2)
    return Motion(*found)
