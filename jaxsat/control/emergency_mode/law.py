"""Laws of the magnetic actuator that turn the satellite into its orbital attitude and hold it there (Somov 2018)."""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.control.magnetic_actuator import saturated
from jaxsat.math import float_array

LARGEST = 4.0 * math.tan(math.pi / 8.0)
"""Limit of the wanted acceleration over the attitude gain: the error of a quarter turn (the paper's "about pi/2")."""


class EmergencyLaw(eqx.Module):
    """Gains; the paper gives none. The defaults are those that `experiments/emergency_mode/gains.py` found."""

    attitude_gain: Float[Array, ""] = eqx.field(converter=float_array, default=6.8e-7)
    """Of eq. 2, k_phi [1/s^2]."""
    rate_gain: Float[Array, ""] = eqx.field(converter=float_array, default=3.55e-3)
    """Of eq. 2, k_omega [1/s]."""
    fine_gain: Float[Array, ""] = eqx.field(converter=float_array, default=5.6e-7)
    """Stiffness of eq. 3 against a steady error, p + k c / (1 - b) [1/s^2]."""
    fine_lead: Float[Array, ""] = eqx.field(converter=float_array, default=3.2e-3)
    """Its damping: the part of eq. 3 that follows the error's rate [1/s]."""
    fine_pole: Float[Array, ""] = eqx.field(converter=float_array, default=0.6)
    """The filter's memory from period to period, b_phi."""
    fine_below: Float[Array, ""] = eqx.field(converter=float_array, default=math.radians(3.0))
    """Error below which eq. 3 is in force [rad]."""
    max_dipole: Float[Array, ""] = eqx.field(converter=float_array, default=300.0)
    """Of each coil [A m^2]."""


def wanted_torque(
    law: EmergencyLaw,
    inertia: Float[Array, "3 3"],
    error: Float[Array, "3"],
    rate_error: Float[Array, "3"],
    memory: Float[Array, "3"],
    period: float | Float[Array, ""],
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Torque [N m] for a filtered attitude error [rad] and rate error [rad/s], and the memory of eq. 3 a period on.

    `error` is four times the modified Rodrigues parameters from the wanted attitude to the body. Far off, eq. 2:
    M = -J SC(k_phi error + k_omega rate_error, a). Near, eq. 3, which needs no rate: with g' = b g + c error,
    M = -J SC(k g + p error, a). Only k c counts in it, so k = 1 here; c and p are set by what they do: stiffness
    p + c / (1 - b), and damping of an error that rises steadily, -c period / (1 - b)^2.
    """
    limit = LARGEST * law.attitude_gain
    far = law.attitude_gain * error + law.rate_gain * rate_error
    rest = 1.0 - law.fine_pole
    c = -law.fine_lead * rest**2 / period
    p = law.fine_gain - c / rest
    near = memory + p * error
    fine = jnp.sum(error**2) < law.fine_below**2
    torque = -inertia @ saturated(jnp.where(fine, near, far), limit)
    return torque, law.fine_pole * memory + c * error
