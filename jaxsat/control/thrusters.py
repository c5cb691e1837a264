"""Thrusters in opposite pairs about three axes, on or off: what a wish for torque becomes."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class Thrusters(eqx.Module):
    """Couples about three axes; a firing lasts `min_pulse` at least."""

    torque: Float[Array, "3"]
    """Of one axis while it fires [N m]."""
    axes_body: Float[Array, "3 3"]
    """Unit vectors of the torques in body axes as columns; the identity where they are mounted as drawn."""
    lever: Float[Array, ""]
    """Torque of an axis over the thrust that all its thrusters spend together [m]."""
    min_pulse: Float[Array, ""]
    """Shortest firing [s]."""


class Pulses(eqx.Module):
    """Firings of one control period."""

    torque_body: Float[Array, "3"]
    """Mean over the period [N m]."""
    impulse: Float[Array, ""]
    """Spent by all thrusters [N s]."""
    count: Float[Array, ""]
    """Axes that fired."""


def fire(
    thrusters: Thrusters, wanted: Float[Array, "3"], dead_band: Float[Array, "3"], period: float | Float[Array, ""]
) -> Pulses:
    """Pulses of a control period [s] for a `wanted` mean torque [N m] about the nominal axes.

    An axis stays silent within its `dead_band` [N m] and where the pulse would be shorter than the shortest; it cannot
    fire longer than the period.
    """
    size = jnp.abs(wanted)
    on = jnp.clip(size / thrusters.torque, 0.0, 1.0) * period
    fires = (size > dead_band) & (on >= thrusters.min_pulse)
    on = jnp.where(fires, on, 0.0)
    mean = jnp.sign(wanted) * thrusters.torque * on / period
    spent = jnp.sum(thrusters.torque * on) / thrusters.lever
    return Pulses(thrusters.axes_body @ mean, spent, jnp.sum(jnp.where(fires, 1.0, 0.0)))
