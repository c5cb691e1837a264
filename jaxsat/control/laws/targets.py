"""Attitudes to point to along an orbit: a body axis at Sun, Earth or stars, another near the orbit's normal.

They do not depend on the attitude and are tabulated before anything is simulated.
"""

from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.spatial.transform import Rotation, RotationSpline

Goal = Literal["sun", "nadir", "inertial"]


class Target(eqx.Module):
    """Wanted attitudes at given times."""

    quaternion: Float[Array, "*times 4"]
    """inertial-from-body, scalar first."""
    rate_eci: Float[Array, "*times 3"]
    """Angular velocity of the wanted axes, inertial components [rad/s]."""


def target_along(
    goal: Goal,
    times: np.ndarray,
    position_eci: np.ndarray,
    velocity_eci: np.ndarray,
    sun_eci: np.ndarray,
    *,
    axis: np.ndarray,
    second: np.ndarray,
    direction_eci: np.ndarray | None = None,
) -> Target:
    """Attitudes at rising `times` [s] in which body `axis` points at the goal, `second` as near the normal as it can.

    States of the orbit [m, m/s] and unit vectors to the Sun are [times 3]; the orbit's normal is that of its momentum.
    `direction_eci` is where `axis` points for the goal `inertial`. Rates are those of a spline through the attitudes.
    """
    normal = np.cross(position_eci, velocity_eci)
    if goal == "inertial" and direction_eci is None:
        raise ValueError("target_along: the goal inertial needs direction_eci, where the axis points")
    fixed = np.broadcast_to(np.zeros(3) if direction_eci is None else direction_eci, position_eci.shape)
    to = {"sun": sun_eci, "nadir": -position_eci, "inertial": fixed}[goal]
    # Held against the stars there is no orbit to follow.
    near = np.broadcast_to(normal[:1], normal.shape) if goal == "inertial" else normal
    body = _axes(np.asarray(axis, float)[None], np.asarray(second, float)[None])
    attitudes = Rotation.from_matrix(_axes(to, near) @ np.swapaxes(body, 1, 2))
    spline = RotationSpline(times, attitudes)
    rates = attitudes.apply(spline(times, 1))
    q = attitudes.as_quat(scalar_first=True)
    return Target(jnp.asarray(q), jnp.asarray(rates))


def _axes(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Matrices whose columns are the first vector, what the second has across it, and their product [n 3 3]."""
    x = first / np.linalg.norm(first, axis=1, keepdims=True)
    y = second - np.sum(second * x, axis=1, keepdims=True) * x
    y = y / np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)
