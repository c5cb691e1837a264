"""The turn that is still to be made, as modified Rodrigues parameters, and the rate at which to make it."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import safe_norm


def modified_rodrigues(q: Float[Array, "4"]) -> Float[Array, "3"]:
    """n tan(angle / 4) of a rotation, the shorter way round: its length is 1 at most (Schaub & Junkins 1996)."""
    q = jnp.where(q[0] < 0.0, -q, q)
    return q[1:] / (1.0 + q[0])


def rate_command(
    error: Float[Array, "3"], gain: float | Float[Array, ""], max_rate: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Angular velocity [rad/s] that works off `error`, the modified Rodrigues parameters of the turn to be made.

    `gain` [1/s] times the angle while that is small, `max_rate` [rad/s] at most.
    """
    wanted = 4.0 * gain * error
    size = safe_norm(wanted)
    return wanted * jnp.where(size > max_rate, max_rate / jnp.where(size > 0.0, size, 1.0), 1.0)
