"""Two solar panels that turn about body z: the satellite's inertia by their angle, and the torque of their motion.

Somov 2018, section 2: J(gamma) = J0 + 2 Jp(gamma), and in equation 1 the inertial-gyroscopic torque Mp. At angle zero
the panels' axes are parallel to the body's and their normal is y; at -90 deg, where the emergency mode keeps them, the
normal is body x. (The paper names the normal's axis both xp and yp; only yp about body z comes to body x at -90 deg.)
"""

import math
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross, float_array

PARKED = -math.pi / 2.0
"""Angle of the panels for which the satellite's inertia is given [rad]."""

PanelAngle = Callable[[Float[Array, ""]], Float[Array, ""]]
"""Angle of the panels [rad] by time [s]; twice differentiable."""


class PanelMotion(eqx.Module):
    """How the panels stand and turn at one instant, or at many."""

    angle: Float[Array, "*nodes"]
    """[rad]"""
    rate: Float[Array, "*nodes"]
    """[rad/s]"""
    acceleration: Float[Array, "*nodes"]
    """[rad/s^2]"""


class PanelSlew(eqx.Module):
    """A turn from rest to rest by a polynomial of degree five, whose acceleration begins and ends with zero."""

    begin: Float[Array, ""] = eqx.field(converter=float_array)
    """Angle before [rad]."""
    end: Float[Array, ""] = eqx.field(converter=float_array, default=PARKED)
    """Angle after [rad]."""
    start_s: Float[Array, ""] = eqx.field(converter=float_array, default=0.0)
    duration_s: Float[Array, ""] = eqx.field(converter=float_array, default=900.0)

    def __call__(self, t: Float[Array, ""]) -> Float[Array, ""]:
        s = (t - self.start_s) / self.duration_s
        inside = (s > 0.0) & (s < 1.0)
        s = jnp.where(inside, s, 0.5)
        part = jnp.where(inside, s**3 * (10.0 - 15.0 * s + 6.0 * s**2), jnp.where(t > self.start_s, 1.0, 0.0))
        return self.begin + (self.end - self.begin) * part


def panel_motion(angle: PanelAngle, t: Float[Array, ""]) -> PanelMotion:
    """Angle, rate and acceleration at `t` [s], by derivatives of the angle."""

    def rate(t):
        return jax.jvp(angle, (t,), (jnp.ones_like(t),))

    (value, first), (_, second) = jax.jvp(rate, (t,), (jnp.ones_like(t),))
    return PanelMotion(value, first, second)


def facing_sun(sun_body: Float[Array, "3"]) -> Float[Array, ""]:
    """Angle [rad] at which the panels' normal is nearest to a direction; the direction must not be body z."""
    return jnp.arctan2(-sun_body[0], sun_body[1])


def dcm_body_from_panels(angle: float | Float[Array, ""]) -> Float[Array, "3 3"]:
    """The turn by the panels' angle [rad] about body z."""
    c, s = jnp.cos(jnp.asarray(angle)), jnp.sin(jnp.asarray(angle))
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.stack([jnp.stack([c, -s, zero]), jnp.stack([s, c, zero]), jnp.stack([zero, zero, one])])


def panels_inertia(panel_inertia: Float[Array, "3 3"], angle: float | Float[Array, ""]) -> Float[Array, "3 3"]:
    """2 Jp(gamma): both panels at an angle [rad], body axes [kg m^2].

    `panel_inertia` is that of one in its own axes about a point of the hinge; what it adds along the hinge counts once.
    """
    turn = dcm_body_from_panels(angle)
    return 2.0 * (turn @ panel_inertia @ turn.T)


def inertia_at(
    parked_inertia: Float[Array, "3 3"], panel_inertia: Float[Array, "3 3"], angle: Float[Array, ""]
) -> Float[Array, "3 3"]:
    """J(gamma), the satellite's inertia with the panels at an angle [rad], from that at `PARKED` [kg m^2]."""
    return parked_inertia + panels_inertia(panel_inertia, angle) - panels_inertia(panel_inertia, PARKED)


def panel_momentum(panel_inertia: Float[Array, "3 3"], motion: PanelMotion) -> Float[Array, "3"]:
    """h = 2 Jp e gamma', what turning panels add to J(gamma) w, body axes [N m s]."""
    return panels_inertia(panel_inertia, motion.angle)[:, 2] * motion.rate


def panel_torque(
    panel_inertia: Float[Array, "3 3"], motion: PanelMotion, angular_velocity: Float[Array, "3"]
) -> Float[Array, "3"]:
    """Mp = -(J' w + w x h + h') on the body from the motion of the panels, body axes [N m].

    It is what d(J w + h)/dt + w x (J w + h) = M leaves beside Euler's equation of the body with fixed panels.
    """
    w = angular_velocity
    both = panels_inertia(panel_inertia, motion.angle)
    e = jnp.array([0.0, 0.0, 1.0])
    # J' v = gamma' (e x J v - J (e x v)): the tensor turns with the panels.
    changing = motion.rate * (cross(e, both @ w) - both @ cross(e, w))
    h = both[:, 2] * motion.rate
    h_rate = both[:, 2] * motion.acceleration + motion.rate * cross(e, h)
    return -(changing + cross(w, h) + h_rate)
