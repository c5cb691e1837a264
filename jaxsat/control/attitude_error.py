"""The turn that is still to be made, as modified Rodrigues parameters, and the rate at which to make it."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross, safe_norm, unit


def modified_rodrigues(q: Float[Array, "4"]) -> Float[Array, "3"]:
    """n tan(angle / 4) of a rotation, the shorter way round: its length is 1 at most (Schaub & Junkins 1996)."""
    q = jnp.where(q[0] < 0.0, -q, q)
    return q[1:] / (1.0 + q[0])


def turn_toward(target_body: Float[Array, "3"], sun_body: Float[Array, "3"]) -> Float[Array, "4"]:
    """Quaternion of the least turn of the body that brings its `target_body` onto the Sun (Zhukov 2019, eqs. 27-29).

    About target x Sun, which eq. 27 has the other way round and not as a unit vector. Half a turn about any axis across
    the target where the Sun is opposite. Both are unit vectors in body axes.
    """
    axis = cross(target_body, sun_body)
    # (1 + cos, sin n) is the quaternion of half the angle, but for its length; no angle and no division by its sine.
    w = 1.0 + jnp.sum(target_body * sun_body)
    opposite = w < 1e-9
    least = jnp.abs(target_body)
    x_least = (least[0] <= least[1]) & (least[0] <= least[2])
    helper = jnp.where(x_least, jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0]))
    helper = jnp.where(~x_least & (least[1] > least[2]), jnp.array([0.0, 0.0, 1.0]), helper)
    axis = jnp.where(opposite, unit(cross(target_body, helper)), axis)
    q = jnp.concatenate([jnp.where(opposite, 0.0, w)[None], axis])
    return q / jnp.sqrt(jnp.sum(q**2))


def rate_command(
    error: Float[Array, "3"], gain: float | Float[Array, ""], max_rate: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Angular velocity [rad/s] that works off `error`, the modified Rodrigues parameters of the turn to be made.

    `gain` [1/s] times the angle while that is small, `max_rate` [rad/s] at most.
    """
    wanted = 4.0 * gain * error
    size = safe_norm(wanted)
    return wanted * jnp.where(size > max_rate, max_rate / jnp.where(size > 0.0, size, 1.0), 1.0)
