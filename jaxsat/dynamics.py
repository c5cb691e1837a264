"""Euler's equation and quaternion kinematics of a rigid body."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.environment import OrbitTable
from jaxsat.math import cross, floating, inverse_3x3, optional_floating, quaternion
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque, BodyEnvironment, lag_rate, torques_of
from jaxsat.torques.abstract import required


class AttitudeState(eqx.Module):
    """What is integrated; of many cases with their axes in front."""

    quaternion: Float[Array, "*cases 4"] = eqx.field(converter=floating)
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "*cases 3"] = eqx.field(converter=floating)
    """Of the body against inertial space, body axes [rad/s]."""
    rod_lag: Float[Array, "*cases rods"] | None = eqx.field(converter=optional_floating, default=None)
    """Magnetic state of the hysteresis rods (`jaxsat.torques.hysteresis`); None without them."""


class RigidBody(eqx.Module):
    """The satellite as the right-hand side sees it; the inverse of the inertia is formed once, not at each step."""

    spacecraft: Spacecraft
    inverse_inertia: Float[Array, "*cases 3 3"]
    torques: tuple[AbstractTorque, ...] | None
    """None for those that follow from the satellite's parts (`torques_of`)."""


def rigid_body(spacecraft: Spacecraft, torques: tuple[AbstractTorque, ...] | None = None) -> RigidBody:
    """A satellite and the torques on it, by default those of its parts, ready to integrate."""
    return RigidBody(spacecraft, inverse_3x3(spacecraft.inertia), torques)


def body_environment(state: AttitudeState, point: OrbitTable) -> BodyEnvironment:
    """One entry of an orbit's table as the satellite meets it; what the table lacks stays None."""

    def body(vector_eci: Float[Array, "3"] | None) -> Float[Array, "3"] | None:
        return None if vector_eci is None else quaternion.rotate_inverse(state.quaternion, vector_eci)

    b_field = quaternion.rotate_inverse(state.quaternion, point.b_field_eci)
    w, b_rate = state.angular_velocity, body(point.b_rate_eci)
    return BodyEnvironment(
        position_body=quaternion.rotate_inverse(state.quaternion, point.position_eci),
        b_field_body=b_field,
        angular_velocity=w,
        # Transport theorem: components change by the field's own rate and by the turn of the axes.
        b_field_rate_body=None if b_rate is None else b_rate - cross(w, b_field),
        air_velocity_body=body(point.air_velocity_eci),
        air_density=point.air_density,
        sun_body=body(point.sun_eci),
        solar_pressure=point.solar_pressure,
        rod_lag=state.rod_lag,
        # Taken from the table, where it is common to all attitudes.
        distance=jnp.sqrt(jnp.sum(point.position_eci**2)),
        commands=None if point.commands is None else point.commands.values,
        command_rates=None if point.commands is None else point.commands.rates,
        time=point.time,
    )


def derivative(
    state: AttitudeState, point: OrbitTable, body: RigidBody, *, rising: Bool[Array, " rods"] | None = None
) -> AttitudeState:
    """Time derivative of the state at one entry of an orbit's table (Markley & Crassidis 2014, eqs. 3.20 and 3.147).

    The equations of `rigid_body_rates`, and the law of the hysteresis rods where there are any; `rising` as in
    `lag_rate`.
    """
    q, w = state.quaternion, state.angular_velocity
    around = body_environment(state, point)

    # Gathered here and not before: the parts' numbers are then those of one case, and there once.
    torques = torques_of(body.spacecraft, around) if body.torques is None else body.torques
    torque = sum((t(body.spacecraft, around) for t in torques), start=jnp.zeros_like(w))
    q_dot, w_dot = rigid_body_rates(q, w, torque, body.spacecraft.inertia, body.inverse_inertia)
    return AttitudeState(q_dot, w_dot, rod_lag_rate(body.spacecraft, around, rising))


def rigid_body_rates(
    q: Float[Array, "4"],
    w: Float[Array, "3"],
    torque: Float[Array, "3"],
    inertia: Float[Array, "3 3"],
    inverse_inertia: Float[Array, "3 3"],
) -> tuple[Float[Array, "4"], Float[Array, "3"]]:
    """Time derivatives of attitude and angular velocity [rad/s^2] under a `torque` in body axes [N m].

    J w' = torque - w x J w,   q' = q (0, w) / 2.
    """
    w_dot = inverse_inertia @ (torque - cross(w, inertia @ w))
    return 0.5 * quaternion.times_vector(q, w), w_dot


def rod_lag_rate(
    spacecraft: Spacecraft, around: BodyEnvironment, rising: Bool[Array, " rods"] | None
) -> Float[Array, " rods"] | None:
    """Rate of the hysteresis rods' lag [1/s], None without them; `rising` as in `lag_rate`."""
    if around.rod_lag is None:
        return None
    user, source = "AttitudeState.rod_lag", "tabulate_orbit(..., field_rate=True)"
    rods = required(spacecraft.hysteresis_rods, user, "Spacecraft.hysteresis_rods", "the rods, as HysteresisRods")
    rate = required(around.b_field_rate_body, user, "OrbitTable.b_rate_eci", source)
    return lag_rate(rods, around.rod_lag, rate, rising)
