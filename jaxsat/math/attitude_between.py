"""Attitude between samples that have their angular velocities."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

NODE_STEP_S, MOST_NODES = 20.0, 20000
"""Largest time between two nodes, and their number, which goes first."""


def attitude_between(
    t_s: Float[np.ndarray, "time"],
    quaternion_inertial_from_body: Float[np.ndarray, "time 4"],
    angular_velocity_rad_s: Float[np.ndarray, "time 3"],
    *,
    largest_turn: float,
) -> tuple[Float[np.ndarray, "nodes"], Float[np.ndarray, "nodes 4"]]:
    """Returns times and attitudes of nodes at most about `largest_turn` [rad] apart; every sample is one.

    The rates, body axes, are joined by a cubic spline and integrated from each sample to the next; what then misses
    the next attitude is spread evenly over the interval. Turns of more than half a revolution are so kept, which great
    arcs from sample to sample would take the short way round. In long gaps the motion is a guess.
    """
    q = np.roll(quaternion_inertial_from_body, -1, axis=1)
    if len(t_s) < 2:
        return t_s, quaternion_inertial_from_body
    dt = np.diff(t_s)
    speed = np.linalg.norm(angular_velocity_rad_s, axis=1)
    turn = 1.02 * np.maximum(speed[1:], speed[:-1]) * dt
    count = np.ceil(np.maximum(turn / largest_turn, dt / NODE_STEP_S))
    count = np.clip(count, 1, max(1, MOST_NODES // len(dt))).astype(int)
    rate = CubicSpline(t_s, angular_velocity_rad_s)

    first = Rotation.from_quat(q[:-1])
    turned = [Rotation.identity(len(dt))]
    for k in range(count.max()):
        h = np.where(k < count, dt / count, 0.0)
        middle = rate(t_s[:-1] + (k + 0.5) * dt / count)
        turned.append(turned[-1] * Rotation.from_rotvec(np.where(k < count, h, 0.0)[:, None] * middle))
    missed = (turned[-1].inv() * first.inv() * Rotation.from_quat(q[1:])).as_rotvec()

    times, attitudes = np.empty((len(dt), count.max())), np.empty((len(dt), count.max(), 4))
    for k in range(count.max()):
        share = np.minimum(k / count, 1.0)
        times[:, k] = t_s[:-1] + share * dt
        attitudes[:, k] = (first * turned[k] * Rotation.from_rotvec(share[:, None] * missed)).as_quat()
    inside = np.arange(count.max()) < count[:, None]
    nodes = np.vstack([attitudes[inside], q[-1:]])
    return np.append(times[inside], t_s[-1]), np.roll(nodes, 1, axis=1)
