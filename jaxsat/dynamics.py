"""Euler's equation and quaternion kinematics of a rigid body."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.environment import OrbitTable
from jaxsat.math import cross, inverse_3x3, quaternion
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque, BodyEnvironment


class AttitudeState(eqx.Module):
    """What is integrated."""

    quaternion: Float[Array, "4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "3"]
    """Of the body against inertial space, body axes [rad/s]."""


class RigidBody(eqx.Module):
    """The satellite as the right-hand side sees it; the inverse of the inertia is formed once, not at each step."""

    spacecraft: Spacecraft
    inverse_inertia: Float[Array, "3 3"]
    torques: tuple[AbstractTorque, ...]


def rigid_body(spacecraft: Spacecraft, torques: tuple[AbstractTorque, ...]) -> RigidBody:
    """A satellite and the torques on it, ready to integrate."""
    return RigidBody(spacecraft, inverse_3x3(spacecraft.inertia), torques)


def derivative(state: AttitudeState, point: OrbitTable, body: RigidBody) -> AttitudeState:
    """Time derivative of the state at one entry of an orbit's table (Markley & Crassidis 2014, eqs. 3.20 and 3.147).

    J w' = sum of torques - w x J w,   q' = q (0, w) / 2.
    """
    q, w, J = state.quaternion, state.angular_velocity, body.spacecraft.inertia
    dcm_inertial_from_body = quaternion.to_dcm(q)
    around = BodyEnvironment(point.position_eci @ dcm_inertial_from_body, point.b_field_eci @ dcm_inertial_from_body, w)

    torque = sum((t(body.spacecraft, around) for t in body.torques), start=jnp.zeros_like(w))
    w_dot = body.inverse_inertia @ (torque - cross(w, J @ w))
    q_dot = 0.5 * quaternion.times_vector(q, w)
    return AttitudeState(q_dot, w_dot)
