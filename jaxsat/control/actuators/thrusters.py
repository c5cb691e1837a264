"""Thrusters in opposite pairs about any axes, on or off: what a wish for torque becomes."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.control.actuators.torquers import Numbers, along_axes
from jaxsat.math import float_array


class Thrusters(eqx.Module):
    """Couples about some axes; a firing lasts `min_pulse` at least."""

    torque: Float[Array, " thrusters"] = eqx.field(converter=float_array)
    """Of one couple while it fires, either way [N m]."""
    axes_body: Float[Array, "3 thrusters"] = eqx.field(converter=float_array)
    """Unit vectors of the torques in body axes as columns."""
    lever: Float[Array, "*each"] = eqx.field(converter=float_array)
    """Torque of a couple over the thrust that all its thrusters spend together [m]; one number, or one each."""
    min_pulse: Float[Array, "*each"] = eqx.field(converter=float_array)
    """Shortest firing [s]."""
    shares: Float[Array, "thrusters 3"] = eqx.field(converter=float_array)
    """What each takes of a torque in body axes where they are mounted as drawn, the least squares of all."""

    @staticmethod
    def along(axes: Numbers, torque: Numbers, lever: Numbers, min_pulse: Numbers = 0.0) -> "Thrusters":
        """Couples about these axes [thrusters 3], which are made unit vectors."""
        units, shares = along_axes(axes)
        torque, lever, min_pulse = (np.broadcast_to(x, (len(units),)) for x in (torque, lever, min_pulse))
        return Thrusters(torque, units.T, lever, min_pulse, shares)


class Pulses(eqx.Module):
    """Firings of one control period."""

    torque_body: Float[Array, "3"]
    """Mean over the period [N m]."""
    impulse: Float[Array, ""]
    """Spent by all thrusters [N s]."""
    count: Float[Array, ""]
    """Couples that fired."""


def fire(
    thrusters: Thrusters,
    torque_body: Float[Array, "3"],
    dead_band: Float[Array, " thrusters"],
    period: float | Float[Array, ""],
) -> Pulses:
    """Pulses of a control period [s] for a wanted mean torque on the body [N m].

    A couple stays silent within its `dead_band` [N m] and where the pulse would be shorter than the shortest; it cannot
    fire longer than the period.
    """
    wanted = thrusters.shares @ torque_body
    size = jnp.abs(wanted)
    on = jnp.clip(size / thrusters.torque, 0.0, 1.0) * period
    fires = (size > dead_band) & (on >= thrusters.min_pulse)
    on = jnp.where(fires, on, 0.0)
    mean = jnp.sign(wanted) * thrusters.torque * on / period
    spent = jnp.sum(thrusters.torque * on / thrusters.lever)
    return Pulses(thrusters.axes_body @ mean, spent, jnp.sum(jnp.where(fires, 1.0, 0.0)))
