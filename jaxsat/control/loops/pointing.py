"""Pointing as a loop runs it: quaternion feedback by wheels that torquers unload, by torquers alone, by thrusters."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.control.actuators import ReactionWheels, friction, stored_momentum
from jaxsat.control.laws import across_field_dipole, attitude_error, dumping_dipole, pointing_torque
from jaxsat.control.loops.controllers import AbstractController, Commands
from jaxsat.control.loops.estimators import Estimate, Now
from jaxsat.control.loops.samples import Sample
from jaxsat.control.loops.timeline import Instant
from jaxsat.control.loops.watches import AbstractWatch
from jaxsat.control.magnetic_actuator import saturated
from jaxsat.math import float_array, quaternion, safe_norm
from jaxsat.torques.abstract import required

TARGET = "dataclasses.replace(timeline.instants, target_quaternion=..., target_rate_eci=...)"


class Pointing(AbstractController):
    """Turns to the timeline's target and holds it; with wheels their momentum is dumped meanwhile."""

    inertia: Float[Array, "3 3"] = eqx.field(converter=float_array)
    """As known on board [kg m^2]."""
    frequency: Float[Array, ""] = eqx.field(converter=float_array)
    """Of small errors [rad/s]."""
    damping: Float[Array, ""] = eqx.field(converter=float_array)
    """Ratio, 1 for none that swings."""
    slew_rate: Float[Array, ""] = eqx.field(converter=float_array)
    """At most, of large errors [rad/s]."""
    dumping: Float[Array, ""] = eqx.field(converter=float_array)
    """Gain of the cross-product law [1/s]."""
    max_dipole: Float[Array, ""] = eqx.field(converter=float_array)
    """To which dipoles are brought with their direction kept [A m^2]."""
    friction_known: Float[Array, ""] = eqx.field(converter=float_array)
    """Share of the wheels' friction that their motors make good."""
    wheels: ReactionWheels | None
    """None for torquers alone, or for thrusters."""
    by_thrusters: bool = eqx.field(static=True, default=False)

    def start(self) -> None:
        return None

    def update(self, memory: None, estimate: Estimate, now: Now) -> tuple[None, Commands]:
        q = required(estimate.quaternion, "Pointing", "what the estimator does not tell", "an attitude")
        rate = required(estimate.angular_velocity, "Pointing", "what the estimator does not tell", "a gyro")
        field = required(estimate.b_field_body, "Pointing", "what the estimator does not tell", "a magnetometer")
        error, rate_error = off_target(q, rate, now.here)
        # A slew at its steady rate, where both terms are equal and opposite.
        most = self.damping * self.slew_rate / self.frequency
        size = safe_norm(error[1:])
        error = error * jnp.where(size > most, most / jnp.where(size > 0.0, size, 1.0), 1.0)
        stored = jnp.zeros(3)
        if self.wheels is not None and now.truth.wheel_speed is not None:
            stored = stored_momentum(self.wheels, now.truth.wheel_speed)
        torque = pointing_torque(
            error,
            rate_error,
            self.inertia,
            frequency=self.frequency,
            damping=self.damping,
            rate=rate,
            momentum=self.inertia @ rate + stored,
        )
        if estimate.attitude_known is not None:
            torque = jnp.where(estimate.attitude_known, torque, 0.0)
        if self.by_thrusters:
            return None, Commands(jnp.zeros(3), jnp.zeros(3), torque)
        if self.wheels is None:
            return None, Commands(saturated(across_field_dipole(torque, field), self.max_dipole), jnp.zeros(3))
        if now.truth.wheel_speed is not None:
            torque = torque + self.friction_known * (friction(self.wheels, now.truth.wheel_speed) @ self.wheels.axes)
        return None, Commands(saturated(dumping_dipole(self.dumping, stored, field), self.max_dipole), torque)


def off_target(
    q: Float[Array, "4"], rate: Float[Array, "3"], here: Instant
) -> tuple[Float[Array, "4"], Float[Array, "3"]]:
    """Turn from the target to the body, and the body's rate against it [rad/s], body axes; ValueError without one."""
    wanted = required(here.target_quaternion, "Pointing", "Instant.target_quaternion", TARGET)
    turning = required(here.target_rate_eci, "Pointing", "Instant.target_rate_eci", TARGET)
    return attitude_error(q, wanted), rate - quaternion.rotate_inverse(q, turning)


class PointingTally(eqx.Module):
    """What `PointingWatch` notes; squares of twice the sine of half the error."""

    above_until: Float[Array, ""]
    """End of the last period that began with an error at the limit or above [s]; 0 for none."""
    worst: Float[Array, ""]
    """Largest of the last part."""
    total: Float[Array, ""]
    """Sum of the last part."""
    fastest: Float[Array, ""]
    """Largest speed of a wheel over its limit."""
    impulse: Float[Array, ""]
    """Sum of the torquers' dipoles over the time they are on [A m^2 s]."""
    thrust: Float[Array, ""]
    """Impulse that the thrusters have spent [N s]."""


class PointingWatch(AbstractWatch):
    """When the error was last above a limit, and how large it is in the last part of the time."""

    limit: Float[Array, ""] = eqx.field(converter=float_array)
    """[rad]"""
    part_from: Float[Array, ""] = eqx.field(converter=float_array)
    """Begin of the last part [s]."""
    wheels: ReactionWheels | None
    period: float = eqx.field(static=True)
    """[s]"""
    duty: float = eqx.field(static=True)

    def start(self) -> PointingTally:
        zero = jnp.zeros(())
        return PointingTally(zero, zero, zero, zero, zero, zero)

    def update(self, tally: PointingTally, sample: Sample, here: Instant) -> PointingTally:
        error, _ = off_target(sample.motion.quaternion, sample.motion.angular_velocity, here)
        square = 4.0 * jnp.sum(error[1:] ** 2)
        late = here.time >= self.part_from
        fastest = tally.fastest
        if self.wheels is not None and sample.motion.wheel_speed is not None:
            fastest = jnp.maximum(fastest, jnp.max(jnp.abs(sample.motion.wheel_speed) / self.wheels.max_speed))
        beyond = square >= (2.0 * jnp.sin(0.5 * self.limit)) ** 2
        return PointingTally(
            above_until=jnp.where(beyond, here.time + self.period, tally.above_until),
            worst=jnp.where(late, jnp.maximum(tally.worst, square), tally.worst),
            total=tally.total + jnp.where(late, square, 0.0),
            fastest=fastest,
            impulse=tally.impulse + self.duty * self.period * jnp.sum(sample.dipole_sizes),
            thrust=tally.thrust if sample.pulses is None else tally.thrust + sample.pulses.impulse,
        )
