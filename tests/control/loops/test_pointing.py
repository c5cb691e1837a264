"""Targets along a circular orbit, and the feedback that brings a body to them."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from jaxsat.control.laws import across_field_dipole, attitude_error, pointing_torque, target_along

N = 1.1e-3
T = np.linspace(0.0, 600.0, 121)
PLACE = 7e6 * np.stack([np.cos(N * T), np.sin(N * T), 0 * T], axis=1)
SPEED = 7e6 * N * np.stack([-np.sin(N * T), np.cos(N * T), 0 * T], axis=1)
SUN = np.broadcast_to(np.array([0.6, 0.0, 0.8]), PLACE.shape)
AXIS, SECOND = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


def found(goal, **settings):
    target = target_along(goal, T, PLACE, SPEED, SUN, axis=AXIS, second=SECOND, **settings)
    return Rotation.from_quat(np.array(target.quaternion), scalar_first=True), np.array(target.rate_eci)


def test_nadir_turns_once_an_orbit_about_its_normal():
    attitude, rate = found("nadir")
    np.testing.assert_allclose(attitude.apply(AXIS), -PLACE / 7e6, atol=1e-12)
    np.testing.assert_allclose(attitude.apply(SECOND), np.broadcast_to([0, 0, 1.0], PLACE.shape), atol=1e-12)
    # Of a spline through attitudes 5 s apart.
    np.testing.assert_allclose(rate, np.broadcast_to([0, 0, N], PLACE.shape), atol=1e-9)


@pytest.mark.parametrize(
    ("goal", "settings", "at"),
    [("sun", {}, [0.6, 0, 0.8]), ("inertial", {"direction_eci": np.array([0, 1.0, 0])}, [0, 1.0, 0])],
)
def test_sun_and_stars_stand_still(goal, settings, at):
    attitude, rate = found(goal, **settings)
    np.testing.assert_allclose(attitude.apply(AXIS), np.broadcast_to(at, PLACE.shape), atol=1e-12)
    assert np.all(attitude.apply(SECOND)[:, 2] > 0.5)
    np.testing.assert_allclose(rate, 0.0, atol=1e-12)


def test_stars_need_a_direction():
    with pytest.raises(ValueError, match="inertial needs direction_eci"):
        found("inertial")


def test_errors_die_away_as_those_of_an_oscillator():
    """About a target that turns with an orbit, wheels' momentum aboard; for small errors."""
    J, h, f, z = np.diag([0.035, 0.03, 0.007]), np.array([1e-3, -5e-4, 2e-3]), 0.05, 0.7
    turning = np.array([0.0, 0.0, N])

    def torque(t, y):
        wanted = Rotation.from_rotvec(turning * t).as_quat(scalar_first=True)
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:7]
        error = attitude_error(jnp.asarray(q), jnp.asarray(wanted))
        off = w - Rotation.from_quat(q, scalar_first=True).inv().apply(turning)
        given = {"frequency": f, "damping": z, "rate": jnp.asarray(w), "momentum": jnp.asarray(J @ w + y[7:])}
        return np.asarray(pointing_torque(error, jnp.asarray(off), jnp.asarray(J), **given))

    def slope(t, y):
        w, applied = y[4:7], torque(t, y)
        turn = np.concatenate([[-0.5 * y[1:4] @ w], 0.5 * (y[0] * w + np.cross(y[1:4], w))])
        # What turns the body is taken from the wheels.
        return np.concatenate([turn, np.linalg.solve(J, applied - np.cross(w, J @ w + y[7:])), -applied])

    first = 1e-4 * np.array([1.0, -2.0, 0.5])
    start = np.concatenate([Rotation.from_rotvec(first).as_quat(scalar_first=True), turning, h])
    times = np.array([10.0, 40.0])
    ends = solve_ivp(slope, (0.0, 40.0), start, "DOP853", times, rtol=1e-9, atol=1e-13).y.T
    # To first order e' = d and d' = -f^2 e - 2 z f d, in body axes.
    law = np.block([[np.zeros((3, 3)), np.eye(3)], [-(f**2) * np.eye(3), -2.0 * z * f * np.eye(3)]])
    off = turning - Rotation.from_rotvec(first).inv().apply(turning)
    for t, found in zip(times, ends, strict=True):
        wanted = Rotation.from_rotvec(turning * t)
        error = (wanted.inv() * Rotation.from_quat(found[:4], scalar_first=True)).as_rotvec()
        expected = expm(law * t) @ np.concatenate([first, off])
        # Of second order in an error of 1e-4.
        np.testing.assert_allclose(error, expected[:3], rtol=0, atol=3e-4 * float(np.linalg.norm(first)))


def test_torquers_give_what_lies_across_the_field():
    torque, field = np.array([1e-6, -2e-6, 3e-6]), np.array([1e-5, 2e-5, 2e-5])
    given = np.cross(across_field_dipole(jnp.asarray(torque), jnp.asarray(field)), field)
    b = field / np.linalg.norm(field)
    np.testing.assert_allclose(given, torque - b * (b @ torque), rtol=1e-12)
