"""Tolerances are held against a far finer run by another method, at any times; what cannot be held is refused."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import DORMAND_PRINCE_8, RK4, AdamsGrid, StepGrid
from jaxsat.simulate import simulate, simulate_on_grid
from jaxsat.spacecraft import HysteresisRods, MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import HysteresisRodsTorque, PermanentMagnet, ResidualTorque, torques_of

INERTIA = np.array([[0.0514, 0.0014, -0.0022], [0.0014, 0.0549, 0.0011], [-0.0022, 0.0011, 0.0578]])
CRAFT = Spacecraft(
    jnp.asarray(INERTIA),
    jnp.asarray([0.3, 0.004, -0.01]),
    MagneticRods(jnp.asarray([0.035, 0.025]), jnp.eye(3)[1:], jnp.asarray(3.0e-5)),
    SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6)),
)
TORQUES = torques_of(CRAFT)
Q0 = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_quat(scalar_first=True)
START = AttitudeState(jnp.asarray(Q0), jnp.asarray([0.021, -0.013, 0.017]))
# Three samples and 64 steps for most runs: one program serves them.
TIMES = np.array([40.0, 95.0, 150.0])

on_grid = eqx.filter_jit(simulate_on_grid)


def surroundings(times):
    """A round orbit of 100 minutes, in a field that turns twice as fast about a tilted axis."""
    angle = 1.05e-3 * jnp.asarray(times)[:, None]
    c, s, one = jnp.cos(angle), jnp.sin(angle), jnp.ones_like(angle)
    position = 7.1e6 * jnp.concatenate([c, 0.3 * s, 0.95 * s], axis=1)
    field = jnp.concatenate([2.0e-5 * jnp.cos(2 * angle), 2.5e-5 * jnp.sin(2 * angle), 1.5e-5 * one], axis=1)
    rate = 2.1e-3 * jnp.concatenate([-2.0e-5 * jnp.sin(2 * angle), 2.5e-5 * jnp.cos(2 * angle), 0.0 * one], axis=1)
    return OrbitTable(position, field, rate)


tabulate = jax.jit(surroundings)


def reference(times, *, start=0.0, craft=CRAFT, initial=START, torques=TORQUES):
    """RK4 in steps of at most 0.08 s: (0.015)^5 0.08^4 150 / 60 = 1e-13 rad from the truth."""
    grid = StepGrid.through(times, start=start, max_step=0.08, pad_steps=2048)
    return on_grid(craft, initial, tabulate(grid.node_times), grid, torques=torques)


def apart(one, other):
    """Angles between attitudes."""
    p, q = (Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True) for motion in (one, other))
    return (p.inv() * q).magnitude()


def stated(motion):
    """The error and the grid of a motion, which `simulate` always gives."""
    assert motion.error is not None and motion.grid is not None
    return motion.error, motion.grid


@pytest.fixture(scope="module")
def fine():
    return reference(TIMES)


# What the reference itself is off by, with a margin of three.
REFERENCE = 5e-13


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tableau", "tolerance"),
    [(None, 1e-4), (None, 3e-6), (DORMAND_PRINCE_8, 1e-4), (DORMAND_PRINCE_8, 1e-10), (RK4, 1e-3)],
    ids=["Adams 1e-4", "Adams 3e-6", "DP8 1e-4", "DP8 1e-10", "RK4 1e-3"],
)
def test_tolerance_is_held_and_the_error_stated(tableau, tolerance, fine):
    motion = simulate(CRAFT, START, surroundings, TIMES, tolerance=tolerance, tableau=tableau)
    assert isinstance(motion.grid, AdamsGrid if tableau is None else StepGrid)
    assert motion.error is not None and apart(motion, fine).max() - REFERENCE <= motion.error <= tolerance
    assert motion.quaternion.shape == (3, 4) and motion.angular_velocity.shape == (3, 3)
    assert motion.rod_lag is None and motion.diverged == ()
    np.testing.assert_allclose(np.linalg.norm(motion.quaternion, axis=1), 1.0, rtol=1e-15)
    # A rate is off as the attitude is, times the rate of the motion.
    np.testing.assert_allclose(motion.angular_velocity, fine.angular_velocity, atol=0.1 * motion.error + 1e-14)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tableau", "times", "torque"),
    [(None, np.array([5.0, 10.0, 20.0]), 3e-3), (DORMAND_PRINCE_8, np.linspace(0.2, 6.0, 30), 0.1)],
    ids=["Adams, short", "DP8, densely sampled"],
)
def test_motion_that_its_start_says_nothing_of(tableau, times, torque):
    """From rest a strong constant torque spins the satellite up: the first step is far too long, and must be found so.

    The torque stands along a principal axis: the turn is a t^2 / 2.
    """
    craft = eqx.tree_at(lambda c: c.inertia, CRAFT, jnp.diag(jnp.asarray([0.05, 0.055, 0.06])))
    initial = AttitudeState(START.quaternion, jnp.zeros(3))
    torques = (ResidualTorque(np.array([0.0, 0.0, torque])),)
    motion = simulate(craft, initial, surroundings, times, torques=torques, tolerance=1e-6, tableau=tableau)
    turn = Rotation.from_rotvec(0.5 * torque / 0.06 * times[:, None] ** 2 * np.array([0.0, 0.0, 1.0]))
    expected = Rotation.from_quat(Q0, scalar_first=True) * turn
    found = Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True)
    assert (found.inv() * expected).magnitude().max() <= stated(motion)[0] + 1e-12 <= 1.1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("times", "start"),
    [
        ([0.0, 0.7, 149.9], 0.0),
        ([12.5, 12.5, 150.0], 0.0),
        ([1000.0, 1000.001, 1130.0], 980.0),
        ([-20.0, -77.0, -150.0], 0.0),
        ([380.0, 300.0, 300.0], 400.0),
    ],
    ids=["uneven", "repeated", "late", "backward", "backward late"],
)
def test_any_times(times, start):
    times = np.array(times)
    motion = simulate(CRAFT, START, surroundings, times, start=start, tolerance=1e-4)
    assert apart(motion, reference(times, start=start)).max() - REFERENCE <= stated(motion)[0] <= 1e-4
    if times[0] == start:
        np.testing.assert_allclose(motion.quaternion[0], Q0, rtol=4e-16)
    for k in np.flatnonzero(np.diff(times) == 0):
        np.testing.assert_array_equal(motion.quaternion[k], motion.quaternion[k + 1])


@pytest.mark.slow
def test_one_time_and_no_time_at_all(fine):
    """A single sample, and samples at the start, which cost no steps."""
    alone = simulate(CRAFT, START, surroundings, TIMES[2:], tolerance=1e-3, tableau=RK4)
    error, _ = stated(alone)
    assert alone.quaternion.shape == (1, 4) and error <= 1e-3
    np.testing.assert_allclose(alone.quaternion[0], fine.quaternion[2], atol=error)
    still = simulate(CRAFT, START, surroundings, np.full(3, 5.0), start=5.0)
    np.testing.assert_array_equal(still.quaternion, np.tile(Q0, (3, 1)))
    error, grid = stated(still)
    assert error < 1e-15 and not np.any(np.asarray(grid.step))


RODS = HysteresisRods(
    np.eye(3)[:2], np.array([3e-6, 2e-6]), np.array([12.0, 9.0]), np.array([0.004, 0.006]), np.array([0.025, 0.025])
)


@pytest.mark.slow
def test_hysteresis_with_its_kinks_is_held_too():
    """The fields along the rods turn back within the session: there the motion has breaks in its slopes."""
    craft = eqx.tree_at(lambda c: c.hysteresis_rods, CRAFT, RODS, is_leaf=lambda x: x is None)
    initial = AttitudeState(START.quaternion, START.angular_velocity, jnp.zeros(2))
    torques = (PermanentMagnet(), HysteresisRodsTorque())
    given = {"craft": craft, "initial": initial, "torques": torques}
    expected = reference(TIMES, **given)
    motion = simulate(craft, initial, surroundings, TIMES, torques=torques, tolerance=1e-6)
    assert isinstance(motion.grid, StepGrid)
    assert apart(motion, expected).max() <= stated(motion)[0] <= 1e-6
    # The lags go through their whole range; fourth order at kinks, in steps of the tenth of a radian.
    lag = np.asarray(motion.rod_lag)
    assert lag.shape == (3, 2) and np.abs(lag).max() > 0.5
    np.testing.assert_allclose(lag, np.asarray(expected.rod_lag), atol=1e-5)


@pytest.mark.parametrize("tolerance", [0.0, -1e-6, 1.0, 2.0, np.nan])
def test_tolerances_that_are_none(tolerance):
    with pytest.raises(ValueError, match="tolerance must be between 0 and 1 rad"):
        simulate(CRAFT, START, surroundings, TIMES, tolerance=tolerance)


@pytest.mark.parametrize("times", [[1.0, 3.0, 2.0], [-1.0, 1.0, 2.0]])
def test_times_that_turn_round(times):
    with pytest.raises(ValueError, match="times must run in one direction"):
        simulate(CRAFT, START, surroundings, np.array(times))


def test_tolerance_below_rounding_is_refused():
    def nothing(times):
        return OrbitTable(jnp.tile(jnp.asarray([7e6, 0, 0]), (times.shape[0], 1)), jnp.zeros((times.shape[0], 3)))

    with pytest.raises(ValueError, match="no step holds a tolerance of 1e-17 rad; the best agreement was"):
        simulate(CRAFT, START, nothing, np.array([10.0]), torques=(), tolerance=1e-17, tableau=DORMAND_PRINCE_8)


@pytest.mark.parametrize("broken", ["quaternion", "angular_velocity"])
def test_state_that_is_not_finite_is_refused(broken):
    initial = eqx.tree_at(
        lambda s: getattr(s, broken), START, jnp.asarray(np.full(3 + (broken == "quaternion"), np.nan))
    )
    with pytest.raises(ValueError, match="initial state is not finite"):
        simulate(CRAFT, initial, surroundings, TIMES, tolerance=1e-4)


def test_satellite_that_no_body_is_and_state_that_none_is():
    """Before anything is compiled."""

    def refusal(craft=CRAFT, initial=START, **options):
        with pytest.raises(ValueError) as error:
            simulate(craft, initial, surroundings, TIMES, **options)
        return str(error.value)

    def made_of(tensor):
        return eqx.tree_at(lambda c: c.inertia, CRAFT, jnp.asarray(tensor))

    skew = INERTIA + np.outer([0, 1e-3, 0], [0, 0, 1.0])
    for tensor, words in (
        (np.diag([1.0, 1.0, 3.0]), "no body has these principal moments of inertia: 3 exceeds the sum of 1 and 1"),
        (-INERTIA, "inertia tensor is not positive definite"),
        (0.0 * INERTIA, "inertia tensor is not positive definite"),
        (skew, "inertia tensor is not symmetric"),
        (np.nan * INERTIA, "inertia tensor is not finite"),
    ):
        assert f"simulate: spacecraft.inertia: {words}" in refusal(made_of(tensor))
    lost = eqx.tree_at(lambda c: c.magnet, CRAFT, jnp.asarray([0.3, np.nan, 0.0]))
    assert refusal(lost) == "simulate: spacecraft.magnet is not a number"
    torques = (ResidualTorque(np.array([np.nan, 0.0, 0.0])),)
    assert refusal(torques=torques) == "simulate: torques[0].torque is not a number"
    nothing = AttitudeState(jnp.zeros(4), START.angular_velocity)
    assert refusal(initial=nothing) == "simulate: the initial quaternion is zero, which is no attitude"


@pytest.mark.slow
def test_any_multiple_of_a_quaternion_is_the_same_attitude_and_whole_numbers_are_numbers():
    given = {"torques": TORQUES, "tolerance": 1e-4}
    one = simulate(CRAFT, AttitudeState([1, 0, 0, 0], START.angular_velocity), surroundings, TIMES, **given)
    for factor in (0.999, 2.0, -3, 1e-200, 1e300):
        start = AttitudeState(np.array([factor, 0, 0, 0]), START.angular_velocity)
        motion = simulate(CRAFT, start, surroundings, TIMES, **given)
        assert apart(motion, one).max() < 1e-12
    turned = simulate(
        CRAFT, AttitudeState(1.05 * START.quaternion, START.angular_velocity), surroundings, TIMES, **given
    )
    assert apart(turned, simulate(CRAFT, START, surroundings, TIMES, **given)).max() < 1e-9


@pytest.mark.slow
def test_steps_taken_can_be_gone_over_again():
    """The grid of a result gives the same motion, and its slopes in reverse mode."""
    motion = simulate(CRAFT, START, surroundings, TIMES, tolerance=1e-4)
    _, grid = stated(motion)
    table = tabulate(grid.node_times)

    def loss(w):
        again = simulate_on_grid(CRAFT, AttitudeState(START.quaternion, w), table, grid).quaternion
        return jnp.sum(again[1:, 0]), again

    w, h = START.angular_velocity, 1e-6
    run = jax.jit(jax.value_and_grad(loss, has_aux=True))
    (_, again), slope = run(w)
    # Another program of the same steps: rounding, grown by a tumble of four radians.
    np.testing.assert_allclose(again, motion.quaternion, rtol=0, atol=1e-13)
    difference = [(run(w + h * e)[0][0] - run(w - h * e)[0][0]) / (2 * h) for e in jnp.eye(3)]
    # An attitude moves by t / 2 per rate; truncation h^2 t^3 / 24, rounding 1e-16 / h.
    assert 20.0 < np.abs(slope).max() < 100.0
    np.testing.assert_allclose(slope, difference, atol=2e-6)
