"""Which convention the quaternions of a table have: by a direction that a sensor sees, known outside too."""

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from jaxsat.math.on_host import angles_between

FEWEST = 3


@dataclass(frozen=True)
class QuaternionConvention:
    """One way of reading four columns, and how well a direction agrees with it."""

    scalar: str
    """`first` or `last`, as `[motion]` of a satellite file says it."""
    sense: str
    """`inertial_from_body` or `body_from_inertial`."""
    angle_deg: float
    """Median angle between where the sensor sees the direction and where the quaternions put it."""


def quaternion_conventions(
    quaternions: Float[np.ndarray, "n 4"],
    seen_body: Float[np.ndarray, "n 3"],
    known_inertial: Float[np.ndarray, "n 3"],
) -> tuple[QuaternionConvention, ...]:
    """Returns the four ways in which quaternions may be meant, the one that a direction agrees with best first.

    `seen_body` are directions in body axes, of any length, as a magnetometer reads the field or a Sun sensor the Sun;
    `known_inertial` the same at the same instants in the inertial axes of the quaternions. Rows with a NaN are passed
    over. The right way stands near the sensor's own error, wrong ones at tens of degrees; two that stand alike, as
    where the satellite did not turn, cannot be told apart. Raises ValueError for fewer than three whole rows, or a
    quaternion or direction of no length.
    """
    whole = np.isfinite(np.hstack([quaternions, seen_body, known_inertial])).all(axis=1)
    if whole.sum() < FEWEST:
        raise ValueError(f"expected {FEWEST} rows or more without a gap, got {int(whole.sum())}")
    q, seen, known = (np.asarray(each, float)[whole] for each in (quaternions, seen_body, known_inertial))
    for name, each in (("quaternions", q), ("seen_body", seen), ("known_inertial", known)):
        empty = np.flatnonzero(~each.any(axis=1))
        if empty.size:
            raise ValueError(f"{name}: row {np.flatnonzero(whole)[empty[0]]} is zero")
    found = []
    for scalar, sense in itertools.product(("first", "last"), ("inertial_from_body", "body_from_inertial")):
        turn = Rotation.from_quat(q, scalar_first=scalar == "first")
        body = turn.apply(known, inverse=sense == "inertial_from_body")
        off = float(np.median(np.degrees(angles_between(seen, body))))
        found.append(QuaternionConvention(scalar, sense, off))
    return tuple(sorted(found, key=lambda each: each.angle_deg))
