"""Reaction wheels about any axes: torque and speed that they can have, friction, and the momentum that they store.

The satellite's inertia J is that with its wheels locked. A wheel of axial inertia I that turns at s against the body
about the unit vector a has the momentum I (s + a . w) about a, which its torque changes: with motor and friction
together u, I (s' + a . w') = u (Markley & Crassidis 2014, sec. 3.3.5).
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.control.actuators.torquers import Numbers, along_axes
from jaxsat.math import float_array

CREEP = 1.0
"""Speed below which dry friction falls off in a straight line [rad/s], 10 rpm: at rest it has no direction."""


class ReactionWheels(eqx.Module):
    """Wheels with limits; each leaf has one number a wheel."""

    axes: Float[Array, "wheels 3"] = eqx.field(converter=float_array)
    """Unit vectors of the spin at a positive speed, body axes."""
    inertia: Float[Array, " wheels"] = eqx.field(converter=float_array)
    """About their axes [kg m^2]; the satellite's inertia contains it."""
    max_torque: Float[Array, " wheels"] = eqx.field(converter=float_array)
    """Of the motor [N m]."""
    max_speed: Float[Array, " wheels"] = eqx.field(converter=float_array)
    """Against the body [rad/s]."""
    coulomb: Float[Array, " wheels"] = eqx.field(converter=float_array)
    """Dry friction [N m]."""
    viscous: Float[Array, " wheels"] = eqx.field(converter=float_array)
    """Friction over speed [N m s]."""
    shares: Float[Array, "wheels 3"] = eqx.field(converter=float_array)
    """What each takes of a torque in body axes, the least squares of all."""

    @staticmethod
    def along(
        axes: Numbers,
        inertia: Numbers,
        max_torque: Numbers,
        max_speed: Numbers,
        *,
        coulomb: Numbers = 0.0,
        viscous: Numbers = 0.0,
    ) -> "ReactionWheels":
        """Those about these axes [wheels 3], which are made unit vectors."""
        units, shares = along_axes(axes)
        numbers = {
            "inertia": inertia,
            "max_torque": max_torque,
            "max_speed": max_speed,
            "coulomb": coulomb,
            "viscous": viscous,
        }
        each = {name: np.broadcast_to(x, (len(units),)) for name, x in numbers.items()}
        return ReactionWheels(axes=units, shares=shares, **each)


def friction(wheels: ReactionWheels, speed: Float[Array, " wheels"]) -> Float[Array, " wheels"]:
    """Torque of the bearings on each wheel [N m]: -c sign(s) - v s, with a straight line below `CREEP`."""
    return -wheels.coulomb * jnp.clip(speed / CREEP, -1.0, 1.0) - wheels.viscous * speed


def motor_torques(
    wheels: ReactionWheels,
    torque_body: Float[Array, "3"],
    speed: Float[Array, " wheels"],
    period: float | Float[Array, ""],
) -> Float[Array, " wheels"]:
    """Torque of each motor on its wheel [N m] for a wanted torque on the body, held over a control `period` [s].

    Each is cut at what the motor can do, and at what would carry the wheel beyond its largest speed within the period.
    """
    wanted = jnp.clip(-(wheels.shares @ torque_body), -wheels.max_torque, wheels.max_torque)
    # At its limit a wheel may slow down and nothing else.
    low, high = (wheels.inertia * (end - speed) / period for end in (-wheels.max_speed, wheels.max_speed))
    return jnp.clip(wanted, jnp.minimum(low, 0.0), jnp.maximum(high, 0.0))


def stored_momentum(wheels: ReactionWheels, speed: Float[Array, " wheels"]) -> Float[Array, "3"]:
    """Sum of I s a, body axes [N m s]: what the wheels have beyond their share of the body's."""
    return (wheels.inertia * speed) @ wheels.axes
