"""The satellite of a loop: a rigid body with torquers, wheels and thrusters, and the equations of its motion."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.control.actuators import Magnetorquers, ReactionWheels, Thrusters, friction, stored_momentum
from jaxsat.dynamics import AttitudeState, body_environment
from jaxsat.environment import OrbitTable
from jaxsat.math import cross, inverse_3x3, quaternion
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
    """A satellite with actuators that a loop commands; parts that follow columns of telemetry are left out.

    Raises ValueError for rods with hysteresis, whose state no loop carries.
    """
    if spacecraft.hysteresis_rods is not None:
        raise ValueError("vehicle: rods with hysteresis have a state that a loop does not carry: use simulate_many")
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
    point: OrbitTable,
    dipole: Float[Array, "3"],
    motor: Float[Array, " wheels"] | None,
    thrust: Float[Array, "3"] | None = None,
) -> Motion:
    """Rates of the motion at one entry of an orbit's table.

    With the momentum h of satellite and wheels and the torques u of motors and friction on the wheels

        (J - sum I a a^T) w' = torque - w x h - sum u a,    s' = u / I - a . w'

    (Markley & Crassidis 2014, sec. 3.3.5). `dipole` is that of the torquers [A m^2], `motor` the torque of
    each motor [N m], `thrust` that of the thrusters on the body [N m].
    """
    q, w = motion.quaternion, motion.angular_velocity
    around = body_environment(AttitudeState(q, w), point)
    torque = sum((t(vehicle.spacecraft, around) for t in torques_of(vehicle.spacecraft, around)), jnp.zeros_like(w))
    torque = torque + cross(dipole, around.b_field_body) - cross(w, momentum(vehicle, motion))
    torque = torque if thrust is None else torque + thrust
    q_dot = 0.5 * quaternion.times_vector(q, w)
    wheels = vehicle.wheels
    if wheels is None or motor is None or motion.wheel_speed is None:
        return Motion(q_dot, vehicle.inverse_inertia @ torque, None)
    on_wheels = motor + friction(wheels, motion.wheel_speed)
    w_dot = vehicle.inverse_inertia @ (torque - on_wheels @ wheels.axes)
    return Motion(q_dot, w_dot, on_wheels / wheels.inertia - wheels.axes @ w_dot)
