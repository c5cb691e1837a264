"""The satellite of a loop: a rigid body with torquers, wheels and thrusters, and the equations of its motion."""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.control.actuators import Magnetorquers, ReactionWheels, Thrusters, friction, stored_momentum
from jaxsat.dynamics import AttitudeState, RigidBody, body_environment, rod_lag_rate
from jaxsat.environment import OrbitTable
from jaxsat.math import cross, inverse_3x3, quaternion
from jaxsat.math.runge_kutta import RK4, runge_kutta_step
from jaxsat.simulate import past_turns, rod_fields
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import Coil, Wheel, torques_of


class Motion(eqx.Module):
    """What of the satellite moves; of its slope the rates of all of it."""

    quaternion: Float[Array, "*cases 4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "*cases 3"]
    """Body axes [rad/s]."""
    wheel_speed: Float[Array, "*cases wheels"] | None = None
    """Of the wheels against the body [rad/s]; None without wheels."""
    rod_lag: Float[Array, "*cases rods"] | None = None
    """Magnetic state of the hysteresis rods (`jaxsat.torques.hysteresis`); None without them."""


class Vehicle(eqx.Module):
    """A satellite with its actuators as the equations of motion see it."""

    spacecraft: Spacecraft
    inverse_inertia: Float[Array, "*cases 3 3"]
    """Of the inertia without the wheels' own about their axes."""
    torquers: Magnetorquers | None = None
    wheels: ReactionWheels | None = None
    thrusters: Thrusters | None = None


def vehicle(
    spacecraft: Spacecraft,
    torquers: Magnetorquers | None = None,
    wheels: ReactionWheels | None = None,
    thrusters: Thrusters | None = None,
) -> Vehicle:
    """A satellite with actuators that a loop commands; parts that follow columns of telemetry are left out."""
    craft = dataclasses.replace(spacecraft, parts=own_parts(spacecraft.parts))
    return Vehicle(craft, inverse_without_wheels(spacecraft.inertia, wheels), torquers, wheels, thrusters)


def own_parts(parts: tuple[eqx.Module, ...]) -> tuple[eqx.Module, ...]:
    """Parts of a satellite without those that follow columns of telemetry."""
    return tuple(part for part in parts if not isinstance(part, Coil | Wheel))


def inverse_without_wheels(inertia: Float[Array, "3 3"], wheels: ReactionWheels | None) -> Float[Array, "3 3"]:
    """Inverse of the inertia less that of the wheels about their axes, which their bearings do not pass on."""
    if wheels is not None:
        inertia = inertia - (wheels.inertia[:, None] * wheels.axes).T @ wheels.axes
    return inverse_3x3(inertia)


def momentum(vehicle: Vehicle, motion: Motion) -> Float[Array, "3"]:
    """Angular momentum of satellite and wheels, body axes [N m s]."""
    body = vehicle.spacecraft.inertia @ motion.angular_velocity
    if vehicle.wheels is None or motion.wheel_speed is None:
        return body
    return body + stored_momentum(vehicle.wheels, motion.wheel_speed)


def motion_rates(
    vehicle: Vehicle,
    motion: Motion,
    point: OrbitTable | None,
    dipole: Float[Array, "3"],
    motor: Float[Array, " wheels"] | None,
    more: Float[Array, "3"] | None = None,
    rising: Bool[Array, " rods"] | None = None,
) -> Motion:
    """Rates of the motion at one entry of an orbit's table; without one nothing acts but wheels and thrusters.

    With the momentum h of satellite and wheels and the torques u of motors and friction on the wheels

        (J - sum I a a^T) w' = torque - w x h - sum u a,    s' = u / I - a . w'

    (Markley & Crassidis 2014, sec. 3.3.5). `dipole` is that of the torquers [A m^2], `motor` the torque of
    each motor [N m], `more` what else turns the body, as thrusters do [N m]; `rising` as in `lag_rate`.
    """
    q, w = motion.quaternion, motion.angular_velocity
    torque, lag_rate = jnp.zeros_like(w), None
    if point is not None:
        around = body_environment(AttitudeState(q, w, motion.rod_lag), point)
        lag_rate = rod_lag_rate(vehicle.spacecraft, around, rising)
        torque = sum((t(vehicle.spacecraft, around) for t in torques_of(vehicle.spacecraft, around)), torque)
        torque = torque + cross(dipole, around.b_field_body)
    torque = torque - cross(w, momentum(vehicle, motion))
    torque = torque if more is None else torque + more
    q_dot = 0.5 * quaternion.times_vector(q, w)
    wheels = vehicle.wheels
    if wheels is None or motor is None or motion.wheel_speed is None:
        return Motion(q_dot, vehicle.inverse_inertia @ torque, None, lag_rate)
    on_wheels = motor + friction(wheels, motion.wheel_speed)
    w_dot = vehicle.inverse_inertia @ (torque - on_wheels @ wheels.axes)
    return Motion(q_dot, w_dot, on_wheels / wheels.inertia - wheels.axes @ w_dot, lag_rate)


def moved(
    slope: Callable[..., Motion],
    motion: Motion,
    length: float | Float[Array, ""],
    points: tuple[Any, Any, Any],
    vehicle: Vehicle | None = None,
) -> Motion:
    """The motion a step of RK4 later [s], by its `slope(motion, point)` at begin, middle and end of the step.

    Rods with hysteresis, of the `vehicle` that is then given, keep to the branches on which they begin the step, which
    the slope is told as `rising`; where the field along one has turned the end is brought to where the turn leads
    (`jaxsat.simulate.past_turns`).
    """
    if motion.rod_lag is None or vehicle is None:
        return _stepped(slope, motion, length, points)
    body = RigidBody(vehicle.spacecraft, vehicle.inverse_inertia, None)
    state = AttitudeState(motion.quaternion, motion.angular_velocity, motion.rod_lag)
    before = rod_fields(state, points[0], body)
    kept = _stepped(functools.partial(slope, rising=before.rate >= 0.0), motion, length, points)
    state = AttitudeState(kept.quaternion, kept.angular_velocity, kept.rod_lag)
    after = past_turns(state, jnp.asarray(length), before, points[2], body)
    speed = kept.wheel_speed
    if speed is not None and vehicle.wheels is not None:
        # Of what changes the body's rate the wheels notice nothing.
        speed = speed - vehicle.wheels.axes @ (after.angular_velocity - kept.angular_velocity)
    return Motion(after.quaternion, after.angular_velocity, speed, after.rod_lag)


def _stepped(slope, motion, length, points):
    begin, middle, end = points
    motion = runge_kutta_step(RK4, slope, motion, length, (begin, middle, middle, end))
    return dataclasses.replace(motion, quaternion=quaternion.normalize(motion.quaternion))
