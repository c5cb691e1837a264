"""The right-hand side against Euler's equation and the kinematics written in NumPy."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState, body_environment, derivative, rigid_body
from jaxsat.environment import OrbitTable
from jaxsat.spacecraft import HysteresisRods, MagneticRods, SolarPanels, Spacecraft, box_facets, box_normals
from jaxsat.torques import (
    AerodynamicTorque,
    HysteresisRodsTorque,
    ResidualTorque,
    SolarPressureTorque,
    lag_rate,
    torques_of,
)

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
TORQUES = torques_of(CRAFT)
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
    body = rigid_body(CRAFT)
    for k in range(20):
        found = slope(*state_and_point(k), body)
        q_dot, w_dot = textbook(Q[k], W[k], POSITION[k], FIELD[k])
        np.testing.assert_allclose(found.quaternion, q_dot, atol=1e-17)
        # Terms of 4e-4 rad/s^2 cancel to about 1e-5.
        np.testing.assert_allclose(found.angular_velocity, w_dot, atol=1e-17 + 1e-13 * np.abs(w_dot).max())
        assert abs(float(found.quaternion @ Q[k])) < 1e-17


def test_batch_of_states():
    body = rigid_body(CRAFT)

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
    body = rigid_body(CRAFT)
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


RODS = HysteresisRods(
    AXES, np.array([3e-7, 2e-7]), np.array([12.0, 1.6]), np.array([0.004, 0.35]), np.array([0.025, 0.73]), 0.1
)
FULL = eqx.tree_at(
    lambda c: (c.hysteresis_rods, c.facets),
    CRAFT,
    (RODS, box_facets((0.1, 0.2, 0.3), center_of_mass=(0.01, 0, 0.02), specular=0.2, diffuse=0.1)),
    is_leaf=lambda x: x is None,
)
LAG = np.array([0.4, -0.7])


def full_point(k):
    rng = np.random.default_rng(k)
    vectors = {"b_rate_eci": 1e-8 * rng.normal(size=3), "air_velocity_eci": 7e3 * rng.normal(size=3)}
    vectors["sun_eci"] = Rotation.random(rng=rng).apply([1.0, 0, 0])
    numbers = {"air_density": 1e-12, "solar_pressure": 4.4e-6}
    point = {"position_eci": POSITION[k], "b_field_eci": FIELD[k], **vectors, **numbers}
    arrays: dict[str, Any] = {name: jnp.asarray(value) for name, value in point.items()}
    return point, OrbitTable(**arrays)


def test_surroundings_in_body_axes():
    """Each vector as scipy turns it; the field's rate as the difference of its components in the moving axes."""
    for k in range(5):
        point, table = full_point(k)
        body_from_eci = Rotation.from_quat(Q[k], scalar_first=True).inv()
        state = AttitudeState(jnp.asarray(Q[k]), jnp.asarray(W[k]), jnp.asarray(LAG))
        around = body_environment(state, table)
        for name, value in point.items():
            if name not in ("b_rate_eci", "air_density", "solar_pressure"):
                found = getattr(around, name.replace("_eci", "_body"))
                np.testing.assert_allclose(found, body_from_eci.apply(value), rtol=1e-13, atol=1e-15 * abs(value).max())
        assert np.asarray(around.air_density) == 1e-12 and np.asarray(around.solar_pressure) == 4.4e-6
        np.testing.assert_array_equal(around.rod_lag, LAG)

        h = 1e-3
        moved = [
            (Rotation.from_quat(Q[k], scalar_first=True) * Rotation.from_rotvec(t * W[k])).inv().apply(
                FIELD[k] + t * point["b_rate_eci"]
            )
            for t in (h, -h)
        ]  # fmt: skip
        # Truncation (0.02 x 1e-3)^2 and rounding 1e-16 / 1e-3, of 1e-6 T/s.
        np.testing.assert_allclose(
            np.asarray(around.b_field_rate_body), (moved[0] - moved[1]) / (2 * h), atol=1e-9 * 1e-6 * 10
        )


@pytest.mark.slow
def test_all_torques_and_the_rods_state():
    """Euler's equation with the torques summed outside; the rods' state goes by the law of its own."""
    torques = (*TORQUES, AerodynamicTorque(), SolarPressureTorque(), HysteresisRodsTorque())
    torques = (*torques, ResidualTorque(np.array([1e-9, 2e-9, -1e-9])))
    body = rigid_body(FULL, torques)
    for k in range(3):
        _, table = full_point(k)
        state = AttitudeState(jnp.asarray(Q[k]), jnp.asarray(W[k]), jnp.asarray(LAG))
        around = body_environment(state, table)
        total = sum(np.asarray(torque(FULL, around)) for torque in torques)
        found = slope(state, table, body)
        expected = np.linalg.solve(INERTIA, total - np.cross(W[k], INERTIA @ W[k]))
        np.testing.assert_allclose(found.angular_velocity, expected, atol=1e-13 * np.abs(expected).max())
        expected = lag_rate(RODS, jnp.asarray(LAG), jnp.asarray(around.b_field_rate_body))
        np.testing.assert_allclose(np.asarray(found.rod_lag), expected, rtol=1e-12)


def test_without_rods_there_is_no_third_state():
    state, point = state_and_point(0)
    found = slope(state, point, rigid_body(FULL, TORQUES))
    assert found.rod_lag is None and len(jax.tree.leaves(found)) == 2
    around = body_environment(state, point)
    assert len(jax.tree.leaves(around)) == 4


def test_what_the_rods_state_needs_is_named():
    state, point = state_and_point(0)
    lagging = AttitudeState(state.quaternion, state.angular_velocity, jnp.asarray(LAG))
    with pytest.raises(ValueError, match=r"rod_lag needs OrbitTable\.b_rate_eci, .*field_rate=True"):
        derivative(lagging, point, rigid_body(FULL, ()))
    with pytest.raises(ValueError, match=r"rod_lag needs Spacecraft\.hysteresis_rods"):
        derivative(lagging, full_point(0)[1], rigid_body(CRAFT, ()))


@pytest.mark.slow
def test_slopes_through_all_torques_are_finite_and_agree():
    """By attitude, rate, lag and every number of the satellite, in both modes."""
    body = rigid_body(FULL, (AerodynamicTorque(), SolarPressureTorque(), HysteresisRodsTorque()))
    _, table = full_point(1)
    state = AttitudeState(jnp.asarray(Q[1]), jnp.asarray(W[1]), jnp.asarray(LAG))

    def of(state, body):
        found = derivative(state, table, body)
        return jnp.concatenate([1e6 * found.angular_velocity, jnp.asarray(found.rod_lag)])

    forward = jax.tree.leaves(jax.jit(jax.jacfwd(of, argnums=(0, 1)))(state, body))
    reverse = jax.tree.leaves(jax.jit(jax.jacrev(of, argnums=(0, 1)))(state, body))
    for one, other in zip(forward, reverse, strict=True):
        assert np.all(np.isfinite(one))
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12 * np.abs(one).max() + 1e-300)
