"""Torque by magnetorquers where it can be had, across the field, and momentum that wheels are rid of by it."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross


def across_field_dipole(torque_body: Float[Array, "3"], b_field_body: Float[Array, "3"]) -> Float[Array, "3"]:
    """Least dipole that gives the part of a torque [N m] across the field [T]: B x M / B^2 [A m^2]."""
    square = jnp.sum(b_field_body**2)
    return cross(b_field_body, torque_body) / jnp.where(square > 0.0, square, 1.0)


def dumping_dipole(
    gain: float | Float[Array, ""], momentum_body: Float[Array, "3"], b_field_body: Float[Array, "3"]
) -> Float[Array, "3"]:
    """The cross-product law m = -k B x h / B^2 [A m^2] (Markley & Crassidis 2014, sec. 7.5).

    Its torque is -k times what momentum [N m s] there is across the field, `gain` k in 1/s.
    """
    return -gain * across_field_dipole(momentum_body, b_field_body)
