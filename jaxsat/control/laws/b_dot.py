"""B-dot: dipoles against the change of the field in body axes take energy from a turn (Stickler & Alfriend 1976).

In axes that turn at w the field changes by B' = -w x B, but for its own slow change along the orbit. The dipole
m = -k B' / B^2 gives the torque m x B = -k (w - b (b . w)) with b the field's direction: it opposes the turn across the
field. B' is the difference of two readings of a magnetometer, or B x w with a gyro's rate.
"""

import math

import jax.numpy as jnp
from jaxtyping import Array, Float


def damping_dipole(
    gain: float | Float[Array, ""], b_field_body: Float[Array, "3"], b_rate_body: Float[Array, "3"]
) -> Float[Array, "3"]:
    """-k B' / B^2 [A m^2] of a field [T] and its rate in body axes [T/s]; zero without a field. `gain` k [N m s]."""
    square = jnp.sum(b_field_body**2)
    return -gain * b_rate_body / jnp.where(square > 0.0, square, 1.0)


def damping_gain(orbit_rate: float, magnetic_inclination: float, least_moment: float) -> float:
    """k = 2 n (1 + sin i_m) J_min [N m s] (Avanzini & Giulietti 2012): the rate falls as fast as it can.

    Of the orbit's rate n [rad/s], its inclination to the magnetic equator [rad] and the least moment of inertia
    [kg m^2]: a larger gain leaves the turn about the field, which the orbit brings across it no faster.
    """
    return 2.0 * orbit_rate * (1.0 + math.sin(magnetic_inclination)) * least_moment
