"""The right-hand side against Euler's equation and the kinematics written in NumPy."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState, derivative, rigid_body
from jaxsat.environment import OrbitTable
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import MUNIN_TORQUES

MU = 3.986004415e14
INERTIA = np.array([[0.0514, 0.0014, -0.0022], [0.0014, 0.0549, 0.0011], [-0.0022, 0.0011, 0.0578]])
MAGNET, MOMENTS, REFERENCE = np.array([0.3, 0.004, -0.01]), np.array([0.035, 0.025]), 3.0e-5
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.6, 0.8]])
CRAFT = Spacecraft(
    jnp.asarray(INERTIA),
    jnp.asarray(MAGNET),
    MagneticRods(jnp.asarray(MOMENTS), jnp.asarray(AXES), jnp.asarray(REFERENCE)),
    SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6)),
)
RNG = np.random.default_rng(8)
Q = Rotation.random(20, rng=RNG).as_quat(scalar_first=True)
W = 0.02 * RNG.normal(size=(20, 3))
POSITION = 7.5e6 * Rotation.random(20, rng=RNG).apply([1.0, 0, 0])
FIELD = 3e-5 * RNG.normal(size=(20, 3))

slope = eqx.filter_jit(lambda state, point, body: derivative(state, point, body))


def textbook(q, w, position, field):
    """Euler's equation and q' = Omega(w) q / 2, with scipy's rotation for the body components."""
    body_from_eci = Rotation.from_quat(q, scalar_first=True).inv()
    r, b = body_from_eci.apply(position), body_from_eci.apply(field)
    rods = sum(m * (b @ e) / REFERENCE * e for m, e in zip(MOMENTS, AXES, strict=True))
    torque = 3 * MU / np.linalg.norm(r) ** 5 * np.cross(r, INERTIA @ r) + np.cross(MAGNET + rods, b)
    w_dot = np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))
    x, y, z = w
    omega = np.array([[0, -x, -y, -z], [x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]])
    return 0.5 * omega @ q, w_dot


def state_and_point(k):
    return AttitudeState(jnp.asarray(Q[k]), jnp.asarray(W[k])), OrbitTable(
        jnp.asarray(POSITION[k]), jnp.asarray(FIELD[k])
    )


def test_right_hand_side_is_the_textbook_one():
    body = rigid_body(CRAFT, MUNIN_TORQUES)
    for k in range(20):
        found = slope(*state_and_point(k), body)
        q_dot, w_dot = textbook(Q[k], W[k], POSITION[k], FIELD[k])
        np.testing.assert_allclose(found.quaternion, q_dot, atol=1e-17)
        # Terms of 4e-4 rad/s^2 cancel to about 1e-5.
        np.testing.assert_allclose(found.angular_velocity, w_dot, atol=1e-17 + 1e-13 * np.abs(w_dot).max())
        assert abs(float(found.quaternion @ Q[k])) < 1e-17


def test_batch_of_states():
    body = rigid_body(CRAFT, MUNIN_TORQUES)

    def one(q, w, position, field):
        return derivative(AttitudeState(q, w), OrbitTable(position, field), body)

    found = jax.jit(jax.vmap(one))(*map(jnp.asarray, (Q, W, POSITION, FIELD)))
    expected = [textbook(Q[k], W[k], POSITION[k], FIELD[k]) for k in range(20)]
    np.testing.assert_allclose(found.quaternion, [e[0] for e in expected], atol=1e-17)
    np.testing.assert_allclose(found.angular_velocity, [e[1] for e in expected], atol=1e-15)


def test_no_torques_and_no_rate_leave_the_body_alone():
    state, point = state_and_point(0)
    at_rest = AttitudeState(state.quaternion, jnp.zeros(3))
    found = slope(at_rest, point, rigid_body(CRAFT, ()))
    np.testing.assert_array_equal(found.quaternion, 0.0)
    np.testing.assert_array_equal(found.angular_velocity, 0.0)


def test_inverse_of_inertia_is_formed_once_and_follows_its_derivative():
    body = rigid_body(CRAFT, MUNIN_TORQUES)
    np.testing.assert_allclose(body.inverse_inertia @ INERTIA, np.eye(3), atol=1e-14)
    state, point = state_and_point(3)

    def w_dot(inertia):
        craft = eqx.tree_at(lambda c: c.inertia, CRAFT, inertia)
        return derivative(state, point, rigid_body(craft, ())).angular_velocity

    change = np.array([[1e-3, 2e-3, 0], [2e-3, -1e-3, 1e-3], [0, 1e-3, 3e-3]])
    found = jax.jit(jax.jacfwd(lambda x: w_dot(INERTIA + x * change)))(jnp.zeros(()))
    w = W[3]
    free = np.linalg.solve(INERTIA, -np.cross(w, INERTIA @ w))
    # d(J w') = -w x dJ w, so w' changes by J^-1 (-w x dJ w - dJ w').
    expected = np.linalg.solve(INERTIA, -np.cross(w, change @ w) - change @ free)
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-12 * np.abs(expected).max())
