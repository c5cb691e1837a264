"""The closed loop of the emergency mode against SciPy, closed forms and invariants."""

import dataclasses
import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import curve_fit
from scipy.spatial.transform import Rotation

from jaxsat.constants import EARTH_MU
from jaxsat.control.emergency_mode.cases import run_leg
from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.emergency_mode.loop import (
    ALWAYS_OFF,
    ALWAYS_ON,
    Supervisor,
    first_state,
    moved,
    one_period,
    supervised,
)
from jaxsat.control.emergency_mode.orbit import Leg
from jaxsat.control.emergency_mode.vehicle import nominal_vehicle
from jaxsat.math import quaternion

RADIUS = 7.098e6
RATE = math.sqrt(EARTH_MU / RADIUS**3)
PERIODS = 744  # two orbits
VEHICLE = nominal_vehicle()
J = np.asarray(VEHICLE.inertia)
LAW = EmergencyLaw(6e-7, 3e-3, 5e-7, 3e-3, 0.6)


def place(t):
    """Position, normal and a dipole's field on a circular orbit in the plane of x and z, inertial axes."""
    up = np.stack([np.cos(RATE * t), np.zeros_like(t), np.sin(RATE * t)], axis=-1)
    axis = np.array([0.1, 0.17, 0.98]) / np.linalg.norm([0.1, 0.17, 0.98])
    field = 2.3e-5 * (3.0 * (up @ axis)[..., None] * up - axis)
    return RADIUS * up, np.zeros(up.shape) + [0.0, -1.0, 0.0], field


def circular(first=0, distance=1.0):
    """Two orbits from a control period on."""
    t = 8.0 * (2 * first + np.arange(2 * PERIODS + 1))
    position, normal, field = place(t)
    arrays = position * distance, normal, np.full(t.shape, RATE), field, normal, np.zeros(t.shape)
    return Leg(*map(jnp.asarray, arrays))


AROUND = circular()
begin = jax.jit(lambda around, off, w: first_state(around, off, w, VEHICLE))


LIMP = dataclasses.replace(LAW, max_dipole=jnp.asarray(0.0))
"""Of coils without current: the same program serves the drift."""
fly = jax.jit(lambda law, around, state: run_leg(ALWAYS_ON, law, VEHICLE, around, state, jax.random.key(0)))


@functools.cache
def step_of(periods):
    """Nodes and state to the state after control periods in one step, without noise and control."""
    return jax.jit(lambda nodes, s: one_period(ALWAYS_OFF, LAW, VEHICLE, nodes, s, None, periods=periods)[0])


def drifted(state, around=AROUND):
    """Over two orbits without control, on which the noise of the measurements has no effect."""
    return fly(LIMP, around, state)


def nodes_at(*numbers):
    return tuple(jax.tree.map(lambda leaf, k=k: leaf[k], AROUND) for k in numbers)


def start(degrees, axis=(1.0, 0.0, 0.0), rate=None, around=AROUND):
    """Off by an angle about an axis, turning with the orbit by default."""
    vector = np.radians(degrees) * np.array(axis)
    off = Rotation.from_rotvec(vector)
    rate = off.inv().apply([-RATE, 0.0, 0.0]) if rate is None else rate
    return begin(around, quaternion.from_rotation_vector(jnp.asarray(vector)), jnp.asarray(rate))


@pytest.mark.slow
def test_motion_of_one_orbit_is_that_of_scipy():
    """Gravity gradient and a constant dipole, of moments and attitudes at large: RK4 of 16 s against DOP853."""
    state = start(40.0, np.array([1.0, 2.0, -1.0]) / math.sqrt(6.0), rate=[1e-3, -2e-3, 5e-4])
    dipole = np.array([100.0, -200.0, 150.0])

    def slope(t, y):
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        turn = Rotation.from_quat([*q[1:], q[0]]).inv()
        position, _, field = place(np.array(t))
        r = turn.apply(position)
        torque = 3 * EARTH_MU / RADIUS**5 * np.cross(r, J @ r) + np.cross(dipole, turn.apply(field))
        w_dot = np.linalg.solve(J, torque - np.cross(w, J @ w))
        q_dot = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([q_dot, w_dot])

    count = 370
    y0 = np.concatenate([state.quaternion, state.angular_velocity])
    expected = solve_ivp(slope, (0.0, 16.0 * count), y0, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]

    @jax.jit
    def run(q, w):
        def step(state, nodes):
            q, w = state
            return moved(VEHICLE, nodes, q, w, jnp.asarray(dipole)), None

        parts = (slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2))
        nodes = tuple(jax.tree.map(lambda leaf, part=part: leaf[part][:count], AROUND) for part in parts)
        return jax.lax.scan(step, (q, w), nodes)[0]

    q, w = run(state.quaternion, state.angular_velocity)
    apart = 2.0 * np.arccos(np.minimum(abs(np.asarray(q) @ expected[:4] / np.linalg.norm(expected[:4])), 1.0))
    # Two parts in a million of a turn and a half.
    assert apart < 2e-5 and np.max(abs(np.asarray(w) - expected[4:])) < 2e-8


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "expected"), [((1.0, 0.0, 0.0), [0.776286]), ((0.0, 0.6, 0.8), [1.505944, 0.473807])])
def test_librations_have_the_frequencies_of_linear_theory(axis, expected):
    """Pitch about body x; roll and yaw together about z and y (NOTES, section 3), over eight orbits."""
    state, parts = start(0.05, axis), []
    for first in range(0, 4 * PERIODS, PERIODS):
        state, samples = drifted(state, circular(first))
        parts.append(samples.error)
    t = RATE * 16.0 * (1.0 + np.arange(4 * PERIODS))
    y = np.concatenate(parts)[:, int(np.argmax(axis))] * 1e3

    def model(t, *p):
        n = len(expected)
        return sum(p[n + 2 * k] * np.cos(p[k] * t) + p[n + 2 * k + 1] * np.sin(p[k] * t) for k in range(n))

    guess = [*np.array(expected) * 1.01, *[0.3] * 2 * len(expected)]
    found = curve_fit(model, t, y, guess)[0]
    np.testing.assert_allclose(sorted(found[: len(expected)]), sorted(expected), rtol=1e-4)
    assert np.std(y - model(t, *found)) < 2e-3 * np.std(y)


@pytest.mark.slow
def test_gravity_gradient_restores():
    """The vertical axis comes back within a quarter of its period, and never goes farther than it was let go."""
    _, samples = drifted(start(5.0))
    pitch = np.degrees(np.asarray(samples.error)[:, 0])
    quarter = round(0.25 * 2.0 * np.pi / (0.776 * RATE) / 16.0)
    assert pitch[0] > 4.9 and abs(pitch[quarter]) < 0.3 and pitch[2 * quarter] < -4.8
    assert np.max(np.asarray(samples.tilt)) <= np.radians(5.0) * (1 + 1e-6)


@pytest.mark.slow
def test_books_balance():
    """No torque: momentum and energy; gravity gradient on a circle: Jacobi's integral. Over two orbits, to 1e-9."""
    far = circular(distance=1e6)
    state = start(40.0, (0.0, 0.6, 0.8), rate=[1e-3, -8e-4, 5e-4], around=far)
    after, _ = drifted(state, far)

    def momentum(state):
        w = np.asarray(state.angular_velocity)
        q = np.asarray(state.quaternion)
        return Rotation.from_quat([*q[1:], q[0]]).apply(J @ w), 0.5 * w @ J @ w

    (h0, e0), (h1, e1) = momentum(state), momentum(after)
    np.testing.assert_allclose(h1, h0, atol=1e-9 * float(np.linalg.norm(h0)))
    assert e1 == pytest.approx(e0, rel=1e-9)

    state = start(20.0, (0.6, 0.0, 0.8))
    after, _ = drifted(state)

    def jacobi(state, t):
        q = np.asarray(state.quaternion)
        turn = Rotation.from_quat([*q[1:], q[0]]).inv()
        position, normal, _ = place(np.array(t))
        up, n = turn.apply(position / RADIUS), turn.apply(normal)
        w = np.asarray(state.angular_velocity) - RATE * n
        return 0.5 * w @ J @ w + 1.5 * RATE**2 * up @ J @ up - 0.5 * RATE**2 * n @ J @ n

    assert jacobi(after, 16.0 * PERIODS) == pytest.approx(jacobi(state, 0.0), rel=1e-9)


@pytest.mark.slow
def test_the_filter_is_the_mean_of_measurements_by_the_second():
    """Against sixteen attitudes of the second, each from SciPy's rotation: errors, rates and field."""
    state = start(25.0, np.array([2.0, -1.0, 1.0]) / math.sqrt(6.0), rate=[2e-4, 3e-4, -1e-4])
    after = step_of(1)(nodes_at(0, 1, 2), state)
    q0 = np.asarray(state.quaternion)
    first = Rotation.from_quat([*q0[1:], q0[0]])
    rate = 0.5 * (np.asarray(state.angular_velocity) + np.asarray(after.angular_velocity))
    error, field, rates = [], [], []
    for t in range(1, 17):
        position, normal, b = place(np.array(float(t)))
        up = position / RADIUS
        wanted = Rotation.from_matrix(np.stack([-normal, up, np.cross(up, normal)], axis=1))
        body = first * Rotation.from_rotvec(rate * t)
        error.append(4.0 * (wanted.inv() * body).as_mrp())
        field.append(body.inv().apply(b))
        rates.append(rate - RATE * body.inv().apply(normal))
    # The rate changes by 1e-6 rad/s in the period: 1e-6 rad on the way.
    np.testing.assert_allclose(after.seen.error, np.mean(error, axis=0), atol=5e-6)
    np.testing.assert_allclose(after.seen.rate_error, np.mean(rates, axis=0), atol=2e-6)
    # The turn of 0.4 deg bends the field's components by an eighth of its square.
    np.testing.assert_allclose(after.seen.b_field_body, np.mean(field, axis=0), atol=5e-9)


@pytest.mark.slow
def test_four_periods_at_once_while_it_is_off():
    state = start(3.0, (0.0, 0.6, 0.8))
    once, four = step_of(4)(nodes_at(0, 4, 8), state), state
    for k in range(0, 8, 2):
        four = step_of(1)(nodes_at(k, k + 1, k + 2), four)
    np.testing.assert_allclose(once.quaternion, four.quaternion, atol=1e-9)
    np.testing.assert_allclose(once.angular_velocity, four.angular_velocity, atol=1e-10)


@pytest.mark.slow
def test_the_actuator_turns_it_into_the_orbital_attitude():
    """From 11 deg at inertial rest in the field of a dipole: two orbits, and the impulse is that of the dipoles."""
    state = start(11.0, (0.6, 0.0, 0.8), rate=[0.0, 0.0, 0.0])
    after, samples = fly(LAW, AROUND, state)
    error = np.degrees(np.linalg.norm(np.asarray(samples.error), axis=1))
    assert error.max() > 20.0 and error[-93:].max() < 1.5
    dipoles = np.abs(np.asarray(samples.dipole))
    assert dipoles.max() == pytest.approx(300.0) and float(after.impulse) == pytest.approx(16.0 * dipoles.sum())
    assert np.asarray(samples.active).all() and float(after.activations) == 1.0


def test_supervisor():
    """On beyond 1.5 deg; off only after a calm time below 0.3 deg; in between as it was."""
    guard = Supervisor()
    state = start(0.0)

    def asked(size_deg, active, calm):
        seen = eqx.tree_at(lambda s: s.error, state.seen, jnp.array([np.radians(size_deg), 0.0, 0.0]))
        given = eqx.tree_at(
            lambda s: (s.seen, s.active, s.calm), state, (seen, jnp.asarray(active), jnp.asarray(float(calm)))
        )
        on, calm = supervised(guard, given)
        return bool(on), float(calm)

    assert asked(1.51, False, 0.0) == (True, 0.0) and asked(1.49, False, 0.0) == (False, 0.0)
    assert asked(0.2, True, 0.0) == (True, 16.0) and asked(0.2, True, 2984.0) == (False, 3000.0)
    assert asked(0.31, True, 2984.0) == (True, 0.0)


@pytest.mark.slow
def test_slope_of_the_closed_loop_against_differences():
    """Of the error an hour on by the gains of eq. 2, without noise, where no switch lies between the differences."""
    around = jax.tree.map(lambda leaf: leaf[:449], AROUND)
    state = start(20.0, (0.6, 0.0, 0.8))

    def last(logs):
        a, b = jnp.exp(logs)
        law = dataclasses.replace(LAW, attitude_gain=a, rate_gain=b)
        return run_leg(ALWAYS_ON, law, VEHICLE, around, state)[1].error[-1]

    # The value comes with its slope along one direction: a loop of its own would be compiled beside that.
    both = jax.jit(lambda logs, along: jax.jvp(last, (logs,), (along,)))
    logs = np.log([6e-7, 3e-3])
    slopes = np.stack([both(logs, along)[1] for along in np.eye(2)], axis=1)
    assert np.abs(np.asarray(slopes)).min() > 1e-4
    for k in (0, 1):
        step = 1e-7 * np.eye(2)[k]
        ends = [np.asarray(both(logs + way * step, step)[0]) for way in (1, -1)]
        np.testing.assert_allclose(np.asarray(slopes)[:, k], (ends[0] - ends[1]) / 2e-7, rtol=1e-3, atol=1e-5)
