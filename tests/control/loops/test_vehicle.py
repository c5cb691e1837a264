"""Bodies with wheels and torquers against independent equations, conserved momentum, and limits of the actuators."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.control.actuators import Magnetorquers, ReactionWheels, friction, motor_torques, torquer_dipoles
from jaxsat.control.loops import Motion, momentum, motion_rates, vehicle
from jaxsat.control.loops import moved as moved_by
from jaxsat.environment import OrbitTable
from jaxsat.math.runge_kutta import RK4, runge_kutta_step
from jaxsat.spacecraft import HysteresisRods, Spacecraft

J = np.array([[0.035, 0.001, -0.0004], [0.001, 0.034, 0.0002], [-0.0004, 0.0002, 0.007]])
AXES = np.array([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]]) / np.sqrt(3.0)
WHEELS = ReactionWheels.along(AXES, 2e-5, 1e-3, 800.0, coulomb=1e-6, viscous=1e-8)
FAR = OrbitTable(jnp.array([1e15, 0.0, 0.0]), jnp.array([2e-5, -1e-5, 3e-5]))
"""So far from the Earth that its gravity does not turn the satellite."""
MOTORS = np.array([2e-4, -1e-4, 5e-5, -3e-4])
START = Motion(jnp.array([1.0, 0, 0, 0]), jnp.array([0.05, -0.1, 0.02]), jnp.array([100.0, -50.0, 0.2, 300.0]))


@jax.jit
def moved(body, motion, dipole):
    """1000 steps of 0.02 s."""

    def step(motion, _):
        def slope(motion, point):
            return motion_rates(body, motion, point, dipole, jnp.asarray(MOTORS))

        return runge_kutta_step(RK4, slope, motion, 0.02, (FAR,) * 4), None

    return jax.lax.scan(step, motion, None, length=1000)[0]


BODY = vehicle(Spacecraft(jnp.asarray(J)), Magnetorquers.along(np.eye(3), 0.2), WHEELS)


def test_motion_with_wheels_is_that_of_each_bodys_momentum():
    """The platform's and each wheel's own momenta by Newton's law, integrated by SciPy; ours is in speeds."""
    inertia, dipole = 2e-5, np.array([0.1, 0.0, -0.2])
    field = np.array(FAR.b_field_eci)

    def slope(t, y):
        q = Rotation.from_quat(y[:4] / np.linalg.norm(y[:4]), scalar_first=True)
        total, axial = y[4:7], y[7:]
        # Momentum of a wheel about its axis is I (s + a w): what is left is that of the platform without it.
        w = np.linalg.solve(J - inertia * AXES.T @ AXES, total - axial @ AXES)
        speed = axial / inertia - AXES @ w
        rub = -1e-6 * np.clip(speed, -1.0, 1.0) - 1e-8 * speed
        torque = np.cross(dipole, q.inv().apply(field))
        p, v = y[0], y[1:4]
        turn = np.concatenate([[-0.5 * v @ w], 0.5 * (p * w + np.cross(v, w))])
        return np.concatenate([turn, torque - np.cross(w, total), MOTORS + rub])

    w, speed = np.asarray(START.angular_velocity), np.asarray(START.wheel_speed)
    start = np.concatenate([[1.0, 0, 0, 0], J @ w + inertia * speed @ AXES, inertia * (speed + AXES @ w)])
    end = solve_ivp(slope, (0.0, 20.0), start, "DOP853", rtol=1e-12, atol=1e-14, max_step=0.5).y[:, -1]
    found = moved(BODY, START, jnp.asarray(dipole))
    apart = Rotation.from_quat(found.quaternion, scalar_first=True).inv() * Rotation.from_quat(
        end[:4], scalar_first=True
    )
    # RK4 over 20 s in steps of 0.02 s.
    assert apart.magnitude() < 1e-8
    np.testing.assert_allclose(momentum(BODY, found), end[4:7], rtol=0, atol=1e-11)
    np.testing.assert_allclose(
        found.wheel_speed, end[7:] / inertia - AXES @ np.asarray(found.angular_velocity), atol=1e-5
    )


def test_wheels_and_friction_leave_the_momentum_of_all_as_it_is():
    found = moved(BODY, START, jnp.zeros(3))
    before = momentum(BODY, START)
    after = Rotation.from_quat(found.quaternion, scalar_first=True).apply(np.array(momentum(BODY, found)))
    np.testing.assert_allclose(after, before, rtol=0, atol=1e-9 * float(np.linalg.norm(before)))
    assert np.linalg.norm(found.angular_velocity - START.angular_velocity) > 0.01


def test_a_torquer_gives_what_it_can_along_its_axis():
    skewed = Magnetorquers.along(np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 1.0, 1.0]]), [0.2, 0.1, 0.3])
    wanted = np.array([0.5, -0.02, 0.05])
    found = torquer_dipoles(skewed, jnp.asarray(wanted))
    assert float(found[0]) == 0.2
    np.testing.assert_allclose(skewed.dipole(found)[1:], wanted[1:], atol=1e-15)


def test_wheels_keep_to_their_torque_and_speed():
    speed = jnp.array([0.0, 799.99, -800.0, 810.0])
    period = 2.0
    torque = np.asarray(-10.0 * AXES[0] + 0.3 * AXES[1] - 0.2 * AXES[3])
    found = np.asarray(motor_torques(WHEELS, jnp.asarray(torque), speed, period))
    assert np.all(np.abs(found) <= 1e-3)
    ends = np.asarray(speed) + found * period / 2e-5
    assert np.all(np.abs(ends[:3]) <= 800.0 + 1e-9)
    # Beyond its limit a wheel is not driven further.
    assert found[3] <= 0.0
    small = np.asarray(motor_torques(WHEELS, jnp.array([1e-5, 0, 0]), jnp.zeros(4), period))
    np.testing.assert_allclose(small @ AXES, [-1e-5, 0, 0], atol=1e-18)
    np.testing.assert_allclose(friction(WHEELS, jnp.array([500.0, -500.0, 0.5, 0.0])), [-6e-6, 6e-6, -5.05e-7, 0.0])


def test_rods_with_hysteresis_are_carried_as_scipy_has_them():
    """A minute with wheels aboard, in a field that turns along the rods; the law in NumPy, in steps by SciPy."""
    axes, hc, br, bs, volume = np.array([[1.0, 0, 0], [0, 0.6, 0.8]]), 8.0, 0.02, 0.06, 2e-6
    rods = HysteresisRods(axes, [volume] * 2, [hc] * 2, [br] * 2, [bs] * 2)
    craft = vehicle(Spacecraft(jnp.asarray(J), hysteresis_rods=rods), None, WHEELS)
    field, still = np.array(FAR.b_field_eci), jnp.zeros(3)
    here, begin = dataclasses.replace(FAR, b_rate_eci=still), np.array([0.3, -0.2])

    def along(q):
        return axes @ q.inv().apply(field) / (4e-7 * np.pi)

    def slope(t, y):
        q, w, speed, lag = Rotation.from_quat(y[:4], scalar_first=True), y[4:7], y[7:11], y[11:]
        b, k = q.inv().apply(field), np.tan(0.5 * np.pi * br / bs) / hc
        rate = axes @ np.cross(b, w) / (4e-7 * np.pi)
        part = np.clip(0.5 * (1.0 + np.where(rate >= 0.0, lag, -lag)), 0.0, 1.0)
        moment = volume / (4e-7 * np.pi) * (2.0 * bs / np.pi * np.arctan(k * (along(q) - hc * lag))) @ axes
        motors = -1e-6 * np.clip(speed, -1.0, 1.0) - 1e-8 * speed
        total = J @ w + 2e-5 * speed @ AXES
        torque = np.cross(moment, b) - np.cross(w, total) - motors @ AXES
        turned = np.linalg.solve(J - 2e-5 * AXES.T @ AXES, torque)
        p, v = y[0], y[1:4]
        turn = [-0.5 * v @ w], 0.5 * (p * w + np.cross(v, w))
        return np.concatenate([*turn, turned, motors / 2e-5 - AXES @ turned, (1.0 - part**2) * rate / hc])

    first = np.concatenate([*map(np.asarray, (START.quaternion, START.angular_velocity, START.wheel_speed)), begin])
    end = solve_ivp(slope, (0.0, 60.0), first, "DOP853", rtol=1e-10, atol=1e-12, max_step=0.5).y[:, -1]

    @jax.jit
    def run(motion):
        def rates(motion, point, rising=None):
            return motion_rates(craft, motion, point, still, jnp.zeros(4), None, rising)

        def step(motion, _):
            return moved_by(rates, motion, 0.05, (here, here, here), craft), None

        return jax.lax.scan(step, motion, None, length=1200)[0]

    found = run(dataclasses.replace(START, rod_lag=jnp.asarray(begin)))
    # RK4 in steps of 0.006 rad, 1e-8; the rods change the rate by a twentieth.
    np.testing.assert_allclose(found.angular_velocity, end[4:7], rtol=0, atol=2e-8)
    np.testing.assert_allclose(found.wheel_speed, end[7:11], rtol=0, atol=2e-8)
    np.testing.assert_allclose(found.rod_lag, end[11:], rtol=0, atol=1e-7)
    assert np.abs(np.asarray(found.rod_lag) - begin).max() > 0.3
