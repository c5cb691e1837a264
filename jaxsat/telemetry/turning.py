"""Attitude between samples that have their angular velocities."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def attitude_between(
    t_s: Float[np.ndarray, "time"],
    q_inertial_from_body: Float[np.ndarray, "time 4"],
    angular_velocity: Float[np.ndarray, "time 3"],
    *,
    largest_turn: float,
) -> tuple[Float[np.ndarray, "fine"], Float[np.ndarray, "fine 4"]]:
    """Returns times and quaternions, scalar first, the samples among them, no two further apart than about a turn.

    `largest_turn` [rad]. Between two samples the rotation vector from the first is a cubic with the angular velocities
    (body axes [rad/s]) at both ends, its number of whole turns that of the mean angular velocity: right where that
    changes by less than half a turn over the interval.
    """
    attitudes = Rotation.from_quat(np.roll(q_inertial_from_body, -1, axis=1))
    step = np.diff(t_s)[:, None]
    turn = (attitudes[:-1].inv() * attitudes[1:]).as_rotvec()
    expected = 0.5 * (angular_velocity[:-1] + angular_velocity[1:]) * step
    turn = _with_whole_turns(turn, expected)
    start = angular_velocity[:-1] * step
    end = _rotation_vector_rate(turn, angular_velocity[1:] * step)
    counts = np.maximum(1, np.ceil(1.2 * np.linalg.norm(turn, axis=1) / largest_turn).astype(int))
    piece = np.repeat(np.arange(len(counts)), counts)
    x = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[piece]
    x1 = x[:, None]
    # Hermite's cubic from zero: its value is `turn` at x = 1, its slopes are `start` and `end`.
    vector = (
        x1 * (1.0 - x1) ** 2 * start[piece] + x1**2 * (3.0 - 2.0 * x1) * turn[piece] - x1**2 * (1.0 - x1) * end[piece]
    )
    fine = attitudes[piece] * Rotation.from_rotvec(vector)
    times = np.append(t_s[piece] + x * step[piece, 0], t_s[-1])
    q = np.vstack([fine.as_quat(), attitudes[-1:].as_quat()])
    return times, np.roll(q, 1, axis=1)


def _with_whole_turns(turn: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """The rotation vector of the same rotation that is nearest the expected one."""
    angle = np.linalg.norm(turn, axis=1)
    known = angle > 1e-9
    # Of no rotation at all the axis is the expected one.
    far = np.linalg.norm(expected, axis=1)
    axis = np.where(
        known[:, None], turn / np.where(known, angle, 1.0)[:, None], expected / np.where(far > 0, far, 1.0)[:, None]
    )
    whole = np.round((np.sum(axis * expected, axis=1) - angle) / (2.0 * np.pi))
    return turn + 2.0 * np.pi * whole[:, None] * axis


def _rotation_vector_rate(turn: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Derivative of a rotation vector under a rate in body axes (Bortz 1971): w + v x w / 2 + c(v) v x (v x w)."""
    angle = np.linalg.norm(turn, axis=1)[:, None]
    small = angle < 1e-3
    safe = np.where(small, 1.0, angle)
    half = np.sin(0.5 * safe)
    # At whole turns the vector's rate across itself has a pole: there the cubic takes the rate as it is.
    regular = (angle < 1.0) | (np.abs(half) > 0.1)
    factor = (1.0 - 0.5 * safe * np.cos(0.5 * safe) / np.where(regular, half, 1.0)) / safe**2
    factor = np.where(small, 1.0 / 12.0, factor)
    across = np.cross(turn, rate)
    return rate + np.where(regular, 0.5 * across + factor * np.cross(turn, across), 0.0)
