"""On-board law of Sun pointing: damp the rate, search the Sun, turn to it, hold it at a given angle (Zhukov 2019).

The law that the paper cites (KIAM preprint 2018 No. 238) is not to be had. This one has its parts: rate damping, a
search rotation, a slew by the quaternion of the error and modified Rodrigues parameters, and stabilisation with a dead
band; see `SunPointingLaw` for its numbers.
"""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.control.attitude_error import modified_rodrigues, rate_command
from jaxsat.math import cross, float_array, quaternion

DAMPING, SEARCH, SLEW, HOLD = 0, 1, 2, 3
MODES = ("damping", "search", "slew", "hold")


def _degrees(value: float):
    return eqx.field(converter=float_array, default=math.radians(value))


def _number(value: float):
    return eqx.field(converter=float_array, default=value)


class SunPointingLaw(eqx.Module):
    """Gains and thresholds; body rates, and the Sun in instrument axes."""

    sun_angle: Float[Array, ""] = _degrees(0.0)
    """At which the Sun is held from the sensor's axis, 0 to 20 deg, toward its y [rad]."""
    attitude_gain: Float[Array, ""] = _number(0.05)
    """Commanded rate over the angle still to turn [1/s]."""
    rate_gain: Float[Array, ""] = _number(0.5)
    """Commanded angular acceleration over the error of the rate [1/s]."""
    slew_rate: Float[Array, ""] = _degrees(0.5)
    """Largest commanded rate [rad/s]."""
    search_rate: Float[Array, ""] = _degrees(0.5)
    """Of the search rotation [rad/s]."""
    search_turn: Float[Array, ""] = _degrees(400.0)
    """After which the search goes on about the next axis [rad]."""
    damped_rate: Float[Array, ""] = _degrees(0.05)
    """Below it the rate is damped [rad/s]."""
    rate_dead_band: Float[Array, ""] = _degrees(0.02)
    """Errors of the rate that are left alone while the Sun is held [rad/s]; over the attitude gain those of angle."""
    settled_angle: Float[Array, ""] = _degrees(1.0)
    """Error below which a slew is done [rad]; above three times it, one begins."""
    settled_rate: Float[Array, ""] = _degrees(0.05)
    """Rate below which a slew is done [rad/s]."""
    hold_time: Float[Array, ""] = _number(100.0)
    """For which the Sun must be held to be stabilised [s]."""

    def target(self) -> Float[Array, "3"]:
        """Where the Sun shall stand, a unit vector in instrument axes."""
        a = jnp.asarray(self.sun_angle)
        return jnp.stack([jnp.cos(a), jnp.sin(a), jnp.zeros_like(a)])


class Guidance(eqx.Module):
    """What the law remembers."""

    mode: Int[Array, ""]
    """One of `MODES`, by number."""
    time_in_mode: Float[Array, ""]
    """[s]"""
    settled_at: Float[Array, ""]
    """When the Sun had first been held for the hold time [s]; inf before."""


def first_guidance() -> Guidance:
    """Before the first control period."""
    return Guidance(jnp.asarray(DAMPING), jnp.asarray(0.0), jnp.asarray(jnp.inf))


def decide(
    law: SunPointingLaw,
    memory: Guidance,
    sun: Float[Array, "3"],
    known: Bool[Array, ""],
    rate_body: Float[Array, "3"],
    body_from_instrument: Float[Array, "3 3"],
    now: Float[Array, ""],
    period: float | Float[Array, ""],
) -> tuple[Guidance, Float[Array, "3"]]:
    """The memory after one control period [s], and the commanded angular velocity in body axes [rad/s].

    `sun` is the estimated direction in instrument axes, of no meaning where it is not `known`; `rate_body` is the
    gyro's [rad/s].
    """
    target = law.target()
    # About target x Sun, which Zhukov (2019, eq. 27) has the other way round and not as a unit vector.
    q = quaternion.shortest_turn(target, sun)
    # In instrument axes; its vector part turns into body axes as any vector.
    error = jax.lax.optimization_barrier(body_from_instrument @ modified_rodrigues(q))
    # Squares of tan(angle / 4) and of the rate: comparisons need no roots.
    off, rate = jnp.sum(error**2), jnp.sum(rate_body**2)
    near, far = (jnp.tan(0.25 * factor * law.settled_angle) ** 2 for factor in (1.0, 3.0))

    off, rate = jax.lax.optimization_barrier((off, rate))

    damped = rate < law.damped_rate**2
    settled = (off < near) & (rate < law.settled_rate**2)
    mode = memory.mode
    after = jnp.where(mode == DAMPING, jnp.where(damped, jnp.where(known, SLEW, SEARCH), DAMPING), mode)
    after = jnp.where((mode == SEARCH) & known, SLEW, after)
    after = jnp.where(mode == SLEW, jnp.where(known, jnp.where(settled, HOLD, SLEW), SEARCH), after)
    astray = ~known | (off > far)
    after = jnp.where((mode == HOLD) & astray, jnp.where(known, SLEW, SEARCH), after)
    time_in_mode = jnp.where(after == mode, memory.time_in_mode + period, 0.0)
    stable = (after == HOLD) & (time_in_mode >= law.hold_time)
    settled_at = jnp.where(stable, jnp.minimum(memory.settled_at, now), memory.settled_at)

    # About y, then z: a Sun that one of them points at stays at the edge of the field of view about it.
    about_z = jnp.floor(time_in_mode * law.search_rate / law.search_turn) % 2.0 > 0.5
    axis = jnp.where(about_z, body_from_instrument[:, 2], body_from_instrument[:, 1])
    toward = rate_command(error, law.attitude_gain, law.slew_rate)
    command = jnp.where(after == DAMPING, jnp.zeros(3), jnp.where(after == SEARCH, law.search_rate * axis, toward))
    return jax.lax.optimization_barrier((Guidance(after, time_in_mode, settled_at), command))


def wanted_torque(
    law: SunPointingLaw,
    memory: Guidance,
    command: Float[Array, "3"],
    rate_body: Float[Array, "3"],
    inertia: Float[Array, "3 3"],
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Torque for a commanded rate and the dead band of each axis [N m], with the `inertia` [kg m^2] on board."""
    off = command - rate_body
    wanted = inertia @ (law.rate_gain * off) + cross(rate_body, inertia @ rate_body)
    band = jnp.where(memory.mode == HOLD, law.rate_dead_band, 0.0)
    return wanted, law.rate_gain * band * jnp.stack([inertia[0, 0], inertia[1, 1], inertia[2, 2]])
