"""Loops in a field that stands still: damping takes energy and never momentum along the field; many cases as one."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.control.actuators import Magnetorquers, Thrusters
from jaxsat.control.closed_loop import run_cases, run_one
from jaxsat.control.laws import damping_dipole, damping_gain, dumping_dipole
from jaxsat.control.loops import (
    AbstractController,
    AsRead,
    Commands,
    FieldDifference,
    Motion,
    Perfect,
    Plant,
    RateAcrossField,
    RateWatch,
    Schedule,
    channel,
    first_state,
    loop,
    step_within,
    unchanging,
    vehicle,
)
from jaxsat.environment import OrbitTable
from jaxsat.sensors import Magnetometer
from jaxsat.spacecraft import Spacecraft

J = np.diag([0.035, 0.034, 0.007])
FIELD = np.array([1e-5, 2e-5, 3e-5])
FAR, PERIODS, PERIOD, DUTY, RESIDUAL = 1e15, 60, 2.0, 0.75, 0.05
SCHEDULE = Schedule(PERIOD, 0.5, DUTY)
BODY = vehicle(Spacecraft(jnp.asarray(J)), Magnetorquers.along(np.eye(3), 0.2, RESIDUAL))


# No Earth near, and one field.
HERE = OrbitTable(jnp.array([FAR, 0.0, 0.0]), jnp.asarray(FIELD))
SUN = np.array([1.0, 0.0, 0.0])
AROUND = unchanging(SCHEDULE, PERIODS, SUN, HERE)
START = Motion(jnp.array([1.0, 0, 0, 0]), jnp.array([0.1, -0.15, 0.05]))


def run(estimator, controller, channels, key=None):
    watch = RateWatch(0.05, PERIOD, DUTY)
    plant = Plant(BODY, channels, AROUND)
    made = loop(plant, estimator, controller, SCHEDULE, watch=watch)
    start = first_state(plant, estimator, controller, START, watch=watch)
    return run_one(made, (BODY, channels, estimator, controller), start, key, PERIODS)


@pytest.fixture(scope="module")
def damped():
    return jax.jit(lambda: run(Perfect(), RateAcrossField(2e-4), {}))()


def test_damping_takes_energy_and_no_momentum_along_the_field(damped):
    _, samples = damped
    w = np.array(samples.motion.angular_velocity)
    energy = 0.5 * np.einsum("ti,ij,tj->t", w, J, w)
    assert np.all(np.diff(energy) < 0.0) and energy[-1] < 0.9 * energy[0]
    momentum = Rotation.from_quat(np.array(samples.motion.quaternion), scalar_first=True).apply(w @ J)
    along = momentum @ FIELD / np.linalg.norm(FIELD)
    # RK4 in steps of a tenth of a radian.
    np.testing.assert_allclose(along, along[0], rtol=2e-6)
    # Across the field it falls.
    assert np.linalg.norm(momentum[-1]) < 0.95 * np.linalg.norm(momentum[0])


def test_coils_that_are_off_keep_their_residual(damped):
    """Momentum's change over a period is the integral of dipole x field with the duty and what is left beside it."""
    _, samples = damped
    k = 5
    q = Rotation.from_quat(np.array(samples.motion.quaternion), scalar_first=True)
    momentum = q.apply(np.array(samples.motion.angular_velocity) @ J)
    dipole = q.apply(np.array(samples.dipoles))
    turned = np.cross(dipole[k], FIELD) * PERIOD * (DUTY + (1.0 - DUTY) * RESIDUAL)
    # The body turns by 20 deg meanwhile.
    np.testing.assert_allclose(momentum[k + 1] - momentum[k], turned, rtol=0, atol=0.4 * float(np.linalg.norm(turned)))
    end, _ = damped
    impulse = DUTY * PERIOD * np.abs(np.array(samples.dipoles)).sum()
    np.testing.assert_allclose(end.tally.impulse, impulse, rtol=1e-12)


def test_differences_of_readings_damp_as_well():
    channels = {"field": channel(Magnetometer(), sigma=1e-7)}
    end, samples = jax.jit(lambda key: run(AsRead(), FieldDifference(2e-4), channels, key))(jax.random.key(1))
    dipoles = np.asarray(samples.dipoles)
    assert not dipoles[0].any() and dipoles[1].any()
    w = np.asarray(samples.motion.angular_velocity)
    assert w[-1] @ J @ w[-1] < 0.9 * w[0] @ J @ w[0]
    field = np.asarray(samples.readings["field"].value)
    expected = damping_dipole(2e-4, jnp.asarray(field[7]), jnp.asarray((field[7] - field[6]) / PERIOD))
    np.testing.assert_allclose(dipoles[7], np.clip(expected, -0.2, 0.2), rtol=1e-9)


def test_many_cases_are_as_one_and_the_slope_by_the_gain_is_that_of_differences():
    channels = {"field": channel(Magnetometer(), sigma=1e-7)}
    around = unchanging(SCHEDULE, 20, SUN, HERE)
    plant, estimator = Plant(BODY, channels, around), AsRead()
    keys = jax.random.split(jax.random.key(2), 5)
    q = jax.random.normal(jax.random.key(3), (5, 4))
    w = 0.1 * jax.random.normal(jax.random.key(4), (5, 3))
    motions = Motion(q / jnp.linalg.norm(q, axis=1, keepdims=True), w)

    def at(gain):
        controller = FieldDifference(gain)
        fixed = (BODY, channels, estimator, controller)
        start = jax.vmap(lambda motion: first_state(plant, estimator, controller, motion))(motions)
        return loop(plant, estimator, controller, SCHEDULE), fixed, start

    @jax.jit
    def together(gain):
        made, fixed, start = at(gain)
        return run_cases(made, fixed, start, keys, 20).motion.angular_velocity

    def alone(gain):
        made, fixed, start = at(gain)
        return jax.vmap(lambda state, key: run_one(made, fixed, state, key, 20)[0].motion.angular_velocity)(start, keys)

    @jax.jit
    def mean(gain):
        return jax.jvp(lambda gain: jnp.mean(jnp.sqrt(jnp.sum(alone(gain) ** 2, axis=1))), (gain,), (1.0,))

    gain, h = 1e-4, 1e-7
    value, slope = mean(gain)
    difference = (mean(gain + h)[0] - mean(gain - h)[0]) / (2.0 * h)
    assert slope < 0.0
    # Central differences: rounding of the mean over h, and their third derivative.
    np.testing.assert_allclose(slope, difference, rtol=1e-6)
    found = together(gain)
    np.testing.assert_allclose(value, np.mean(np.linalg.norm(found, axis=1)), rtol=1e-12)


class Steady(AbstractController):
    """The same torque of the thrusters all the time."""

    def start(self):
        return None

    def update(self, memory, estimate, now):
        # The third couple's pulse would be too short.
        return None, Commands(jnp.zeros(3), jnp.zeros(3), jnp.array([1e-3, -5e-4, 1e-5]), jnp.zeros(3))


def test_thrusters_turn_a_body_as_scipy_has_it_and_spend_their_impulse():
    schedule, J, torque = Schedule(1.0, 0.1), np.diag([0.035, 0.034, 0.007]) + 1e-3, np.array([1e-3, -5e-4, 0.0])
    craft = vehicle(Spacecraft(jnp.asarray(J)), thrusters=Thrusters.along(np.eye(3), 2e-3, [0.1, 0.2, 0.1], 0.01))
    plant, law = Plant(craft, {}, unchanging(schedule, 3, SUN)), Steady()
    start = first_state(plant, Perfect(), law, START)
    end, samples = jax.jit(
        lambda: run_one(loop(plant, Perfect(), law, schedule), (craft, {}, Perfect(), law), start, None, 3)
    )()

    def slope(_, y):
        q, w = y[:4], y[4:]
        turn = np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([0.5 * turn, np.linalg.solve(J, torque - np.cross(w, J @ w))])

    first = np.concatenate([START.quaternion, START.angular_velocity])
    exact = solve_ivp(slope, (0.0, 3.0), first, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    # RK4 in steps of a fiftieth of a radian.
    np.testing.assert_allclose(end.motion.angular_velocity, exact[4:], atol=1e-9)
    np.testing.assert_allclose(end.motion.quaternion, exact[:4], atol=1e-9)
    np.testing.assert_allclose(samples.pulses.impulse, 1e-3 / 0.1 + 5e-4 / 0.2, rtol=1e-12)
    np.testing.assert_array_equal(samples.pulses.count, 2.0)


def test_schedules_have_steps_that_end_where_coils_switch():
    schedule = Schedule(2.0, 0.3, 0.8, modes=((100.0, 1), (200.0, 0)))
    assert schedule.edges[0] == 0.0 and schedule.edges[-1] == 2.0 and 1.6 in schedule.edges
    assert np.diff(schedule.edges).max() <= 0.3 and schedule.on.sum() == 6 and len(schedule.on) == 8
    np.testing.assert_array_equal(schedule.mode_at(np.array([0.0, 99.9, 100.0, 250.0])), [0, 0, 1, 0])
    assert schedule.periods(4.0) == 2 and schedule.periods(4.1) == 3
    with pytest.raises(ValueError, match="duty must be above 0"):
        Schedule(2.0, 0.3, 0.0)
    # Of each step of a steady turn RK4 leaves out the fifth power of half the angle, over 120, twice as an angle.
    step = step_within(1e-6, 0.1, 1e4)
    assert 2.0 / 120.0 * (0.05 * step) ** 5 * 1e4 / step == pytest.approx(8e-8)


def test_laws_are_their_formulas():
    field, rate = np.array([1e-5, 2e-5, -3e-5]), np.array([1e-6, 0, 2e-6])
    np.testing.assert_allclose(
        damping_dipole(2.0, jnp.asarray(field), jnp.asarray(rate)), -2.0 * rate / (field @ field)
    )
    momentum = np.array([1e-3, -2e-3, 5e-4])
    torque = np.cross(dumping_dipole(0.01, jnp.asarray(momentum), jnp.asarray(field)), field)
    b = field / np.linalg.norm(field)
    np.testing.assert_allclose(torque, -0.01 * (momentum - b * (b @ momentum)), rtol=1e-12)
    assert damping_gain(1.1e-3, math.pi / 2, 0.01) == pytest.approx(4.4e-5)


def test_what_no_sensor_tells_is_named():
    with pytest.raises(ValueError, match="RateAcrossField needs .*: give a gyro"):
        run(AsRead(), RateAcrossField(1e-4), {"field": channel(Magnetometer())})


def test_the_timeline_needs_a_sun():
    from jaxsat.control.loops import timeline
    from jaxsat.environment import KeplerOrbit, Surroundings, igrf_field

    around = Surroundings(KeplerOrbit(7e6, 0.0, 1.0, 0.0, 0.0, 0.0), igrf_field(2026.0), 0.0)
    with pytest.raises(ValueError, match="Surroundings.sun is None"):
        timeline(dataclasses.replace(around), SCHEDULE, 3)
