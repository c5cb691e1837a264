"""Proportional and derivative feedback of the quaternion (Wie, Weiss & Arapostathis 1989).

For the error q_e, body from target, and the error of the rate d, the torque -k J q_v sign(q_0) - c J d with the
gyroscopic torque added turns the body about the axis of the error, the shorter way. Small errors obey
e'' + c e' + (k / 2) e = 0: the frequency is sqrt(k / 2) and the damping c / sqrt(2 k).
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross, quaternion


def attitude_error(q: Float[Array, "4"], q_target: Float[Array, "4"]) -> Float[Array, "4"]:
    """Turn from the target to the body, scalar first and not negative; both inertial-from-body."""
    off = quaternion.multiply(quaternion.conjugate(q_target), q)
    return jnp.where(off[0] < 0.0, -off, off)


def pointing_torque(
    error: Float[Array, "4"],
    rate_error: Float[Array, "3"],
    inertia: Float[Array, "3 3"],
    *,
    frequency: float | Float[Array, ""],
    damping: float | Float[Array, ""],
    rate: Float[Array, "3"],
    momentum: Float[Array, "3"],
) -> Float[Array, "3"]:
    """Torque on the body [N m], body axes, that brings `error` to nothing at a `frequency` [rad/s] and `damping` ratio.

    `rate_error` is that of the body's `rate` against the target's, body axes [rad/s]. The target turns steadily against
    the stars; `momentum` is J w and that of wheels [N m s], whose gyroscopic torque is made good (Wie, Weiss &
    Arapostathis 1989; Markley & Crassidis 2014, sec. 7.2).
    """
    wanted = -2.0 * frequency**2 * error[1:] - 2.0 * damping * frequency * rate_error
    # Of a steady target the components in body axes change by -w x w_t, and w x w is none.
    return inertia @ (wanted + cross(rate, rate_error)) + cross(rate, momentum)
