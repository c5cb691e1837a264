"""Many cases at once move as each of them alone, whatever the chunks; one that is lost leaves the others alone."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate, simulate_many, simulate_on_grid
from jaxsat.spacecraft import HysteresisRods, MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import HysteresisRodsTorque, PermanentMagnet, torques_of

pytestmark = pytest.mark.slow

INERTIA = np.array([[0.0514, 0.0014, -0.0022], [0.0014, 0.0549, 0.0011], [-0.0022, 0.0011, 0.0578]])
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.6, 0.8]])
CRAFT = Spacecraft(
    jnp.asarray(INERTIA),
    jnp.asarray([0.3, 0.004, -0.01]),
    MagneticRods(jnp.asarray([0.035, 0.025]), jnp.asarray(AXES), jnp.asarray(3.0e-5)),
    SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6)),
)
TORQUES = torques_of(CRAFT)
# No more than 64 steps of any of the runs below, a tolerance of 1e-4 being asked for or not: one program serves them.
TIMES = np.array([26.0, 62.0, 98.0])
# Whole vectors of a processor to a chunk, of which the cases are no multiple.
CASES, CHUNK, STEP = 5, 4, 3.0
RNG = np.random.default_rng(4)
INITIAL = jax.vmap(AttitudeState)(
    jnp.asarray(Rotation.random(CASES, rng=RNG).as_quat(scalar_first=True)),
    jnp.asarray(0.02 * RNG.normal(size=(CASES, 3))),
)


def surroundings(times):
    """A round orbit of 100 minutes, in a field that turns twice as fast about a tilted axis."""
    angle = 1.05e-3 * jnp.asarray(times)[:, None]
    c, s, one = jnp.cos(angle), jnp.sin(angle), jnp.ones_like(angle)
    position = 7.1e6 * jnp.concatenate([c, 0.3 * s, 0.95 * s], axis=1)
    field = jnp.concatenate([2.0e-5 * jnp.cos(2 * angle), 2.5e-5 * jnp.sin(2 * angle), 1.5e-5 * one], axis=1)
    rate = 2.1e-3 * jnp.concatenate([-2.0e-5 * jnp.sin(2 * angle), 2.5e-5 * jnp.cos(2 * angle), 0.0 * one], axis=1)
    return OrbitTable(position, field, rate)


tabulate = jax.jit(surroundings)


def reference(times, *, start=0.0, craft=CRAFT, initial=INITIAL, torques=TORQUES):
    """RK4 in steps of at most 0.08 s, each case by itself: 1e-13 rad from the truth, as in `test_single`."""
    grid = StepGrid.through(times, start=start, max_step=0.08, pad_steps=2048)
    table = tabulate(grid.node_times)
    axis = 0 if craft.inertia.ndim == 3 else None
    return every_case(axis, torques)(craft, initial, table, grid)


@functools.cache
def every_case(craft_axis, torques):
    def one(craft, initial, table, grid):
        motion = simulate_on_grid(craft, initial, table, grid, torques=torques)
        return motion.quaternion, motion.angular_velocity, motion.rod_lag

    return eqx.filter_jit(jax.vmap(one, in_axes=(craft_axis, 0, None, None)))


def some(tree, chosen):
    return jax.tree.map(lambda x: x[np.asarray(chosen)], tree)


def apart(one, other):
    """Angles between attitudes."""
    p, q = (Rotation.from_quat(np.asarray(x).reshape(-1, 4), scalar_first=True) for x in (one, other))
    return (p.inv() * q).magnitude()


def at_step(initial=INITIAL, times=TIMES, **options):
    given = {"max_step": STEP, "chunk": CHUNK, **options}
    return simulate_many(CRAFT, initial, surroundings, times, **given)


@pytest.fixture(scope="module")
def whole():
    return at_step()


def assert_same(one, other):
    np.testing.assert_array_equal(one.quaternion, other.quaternion)
    np.testing.assert_array_equal(one.angular_velocity, other.angular_velocity)


def test_tolerance_is_held_and_the_error_stated():
    """Five cases in chunks of four, the pilot one of them."""
    quaternion, rate, _ = reference(TIMES)
    motion = simulate_many(CRAFT, INITIAL, surroundings, TIMES, tolerance=1e-4, chunk=CHUNK)
    assert motion.quaternion.shape == (CASES, 3, 4) and motion.angular_velocity.shape == (CASES, 3, 3)
    assert motion.rod_lag is None and motion.grid is None and motion.diverged == ()
    true = apart(motion.quaternion, quaternion).max()
    # The worst case may be three times as bad as the worst of the pilot; beside it the reference's own error.
    assert motion.error is not None and true <= 3 * motion.error + 5e-13 <= 1e-4
    np.testing.assert_allclose(motion.angular_velocity, rate, atol=0.1 * true + 1e-14)


def test_a_case_moves_as_it_does_alone(whole):
    initial = jax.tree.map(lambda x: x[2], INITIAL)
    alone = simulate(CRAFT, initial, surroundings, TIMES, tolerance=1e-4)
    assert apart(alone.quaternion, whole.quaternion[2]).max() < 1e-10


def test_given_step_is_taken_unchecked(whole):
    assert whole.error is None
    # By the order, (3 / 1)^10 times the error with 1 s.
    assert 1e-13 < apart(whole.quaternion, reference(TIMES)[0]).max() < 1e-9


@pytest.mark.parametrize("chosen", [[0, 1, 2, 3], [3] * 4, [4, 2, 0, 1, 3], [0, 0, 0, 1, 1, 2, 2, 3, 4]], ids=str)
def test_bits_of_a_case_do_not_depend_on_the_others(chosen, whole):
    """Nor on their number and its place among them, as long as the chunk is the same."""
    assert_same(at_step(some(INITIAL, chosen)), some(whole, chosen))


@pytest.mark.parametrize("times", [[0.0, 0.7, 149.9], [12.5, 12.5, 150.0], [-20.0, -77.0, -150.0]], ids=str)
def test_times_between_the_steps_and_backward(times):
    times = np.array(times)
    motion = at_step(times=times)
    assert apart(motion.quaternion, reference(times)[0]).max() < 1e-9
    if times[0] == 0.0:
        np.testing.assert_allclose(motion.quaternion[:, 0], INITIAL.quaternion, rtol=0, atol=4e-16)
    if times[0] == times[1]:
        np.testing.assert_array_equal(motion.quaternion[:, 0], motion.quaternion[:, 1])


def test_late_start():
    times = np.array([1020.0, 1075.0, 1130.0])
    assert apart(at_step(times=times, start=980.0).quaternion, reference(times, start=980.0)[0]).max() < 1e-9


def test_one_case_and_the_end_alone(whole):
    """In a chunk of one, and nothing is kept on the way."""
    motion = at_step(some(INITIAL, [3]), times=TIMES[2:])
    assert motion.quaternion.shape == (1, 1, 4)
    # Another program: rounding, grown by a tumble of some radians.
    np.testing.assert_allclose(motion.quaternion[0, 0], whole.quaternion[3, 2], rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion.angular_velocity[0, 0], whole.angular_velocity[3, 2], rtol=0, atol=1e-15)


@pytest.fixture(scope="module")
def fleet():
    """Inertia and magnet vary; all leaves are over the cases, those that do not vary too."""
    rng = np.random.default_rng(6)
    craft = jax.tree.map(lambda x: jnp.broadcast_to(x, (CASES, *x.shape)), CRAFT)
    inertia = INERTIA + 0.003 * np.einsum("ci,ij->cij", rng.normal(size=(CASES, 3)), np.eye(3))
    magnet = np.array([0.3, 0.0, 0.0]) + 0.05 * rng.normal(size=(CASES, 3)) * [1.0, 1.0, 0.0]
    return eqx.tree_at(lambda c: (c.inertia, c.magnet), craft, (jnp.asarray(inertia), jnp.asarray(magnet)))


def test_each_case_with_a_spacecraft_of_its_own(fleet):
    motion = simulate_many(fleet, INITIAL, surroundings, TIMES, chunk=CHUNK, tolerance=1e-4)
    quaternion, _, _ = reference(TIMES, craft=fleet)
    assert motion.error is not None
    assert apart(motion.quaternion, quaternion).max() <= 3 * motion.error + 5e-13 <= 1e-4


RODS = HysteresisRods(
    AXES, np.array([3e-6, 2e-6]), np.array([12.0, 9.0]), np.array([0.004, 0.006]), np.array([0.025, 0.025])
)


def test_state_of_the_rods():
    """Two lags for each case, across the turns of their fields."""
    craft = eqx.tree_at(lambda c: c.hysteresis_rods, CRAFT, RODS, is_leaf=lambda x: x is None)
    lag = jnp.asarray(np.random.default_rng(5).uniform(-0.5, 0.5, size=(CASES, 2)))
    initial = jax.vmap(AttitudeState)(INITIAL.quaternion, INITIAL.angular_velocity, lag)
    torques, times = (PermanentMagnet(), HysteresisRodsTorque()), np.array([40.0, 95.0, 150.0])
    motion = simulate_many(craft, initial, surroundings, times, torques=torques, tolerance=1e-5, chunk=CHUNK)
    quaternion, _, expected = reference(times, craft=craft, initial=initial, torques=torques)
    assert motion.rod_lag is not None and motion.rod_lag.shape == (CASES, 3, 2)
    np.testing.assert_allclose(motion.rod_lag, np.asarray(expected), atol=1e-5)
    assert np.abs(np.asarray(motion.rod_lag)[:, 2] - lag).min() > 1e-2
    assert motion.error is not None and motion.errors is not None and motion.unresolved == ()
    # Each by itself; the reference has steps of its own over the turns, of fourth order.
    assert np.all(apart(motion.quaternion, quaternion).reshape(CASES, 3).max(axis=1) <= motion.errors + 1e-9)
    assert motion.error == np.max(motion.errors) <= 1e-5
    # Below rounding nothing is held, which is said; the motions are given all the same.
    with pytest.warns(UserWarning, match="5 of 5 motions are not within 1e-17 rad"):
        beyond = simulate_many(craft, initial, surroundings, times, torques=torques, tolerance=1e-17, chunk=CHUNK)
    assert beyond.unresolved == tuple(range(CASES)) and beyond.error is None and beyond.diverged == ()
    assert apart(beyond.quaternion, motion.quaternion).max() <= motion.error


def broken(**cases):
    """INITIAL with NaN or a huge number in one case of a leaf."""
    leaves = {name: np.array(getattr(INITIAL, name)) for name in ("quaternion", "angular_velocity")}
    for name, (case, value) in cases.items():
        leaves[name][case] = value
    return jax.vmap(AttitudeState)(*map(jnp.asarray, leaves.values()))


@pytest.mark.parametrize(
    "given", [{"max_step": STEP}, {"max_step": None, "tolerance": 1e-4}], ids=["step", "tolerance"]
)
def test_lost_cases_are_listed_and_harm_nobody(given, whole):
    bad = broken(quaternion=(1, np.nan), angular_velocity=(3, np.nan))
    motion = at_step(bad, **given)
    assert motion.diverged == (1, 3)
    others = [0, 2, 4]
    # With a step that is searched, it is that of the others.
    np.testing.assert_allclose(motion.quaternion[np.array(others)], some(whole.quaternion, others), rtol=0, atol=1e-4)
    if given["max_step"] is not None:
        assert_same(some(motion, others), some(whole, others))
    assert not np.any(np.isfinite(motion.quaternion[1])) and np.all(np.isnan(motion.angular_velocity[3]))


def zero_quaternion(case, cases=CASES):
    """`cases` cases, of which one has no attitude."""
    numbers = np.arange(cases) % CASES
    quaternion = np.array(INITIAL.quaternion)[numbers]
    quaternion[case] = 0.0
    return AttitudeState(jnp.asarray(quaternion), INITIAL.angular_velocity[numbers])


@pytest.mark.parametrize("case", [0, 4])
@pytest.mark.parametrize("given", [{"max_step": STEP}, {"max_step": None, "tolerance": 1e-4}], ids=["step", "searched"])
def test_others_are_to_the_bit_as_without_the_lost_one(case, given):
    others = np.delete(np.arange(CASES), case)
    motion, without = at_step(zero_quaternion(case), **given), at_step(some(INITIAL, others), **given)
    assert motion.diverged == (case,) and without.diverged == () and motion.error == without.error
    assert_same(some(motion, others), without)
    assert np.all(np.isnan(motion.quaternion[case])) and np.all(np.isnan(motion.angular_velocity[case]))


def test_all_lost_and_one_that_turns_too_fast():
    motion = at_step(some(zero_quaternion(1), [1, 1]), max_step=None)
    assert motion.diverged == (0, 1) and motion.error is None and motion.quaternion.shape == (2, 3, 4)
    fast = broken(angular_velocity=(2, 1e6))
    given = {"max_step": None, "tolerance": 1e-4}
    motion, without = at_step(fast, **given), at_step(some(INITIAL, [0, 1, 3, 4]), **given)
    assert motion.diverged == (2,) and motion.error == without.error
    assert_same(some(motion, [0, 1, 3, 4]), without)


def test_a_satellite_that_no_body_is_among_others(fleet):
    """Alone lost where it is one case's; refused where it is everybody's."""
    triangle = np.diag([1.0, 1.0, 3.0])
    broken = eqx.tree_at(lambda c: c.inertia, fleet, fleet.inertia.at[2].set(triangle))
    given = {"chunk": CHUNK, "max_step": STEP}
    motion = simulate_many(broken, INITIAL, surroundings, TIMES, **given)
    others = [0, 1, 3, 4]
    assert motion.diverged == (2,)
    assert_same(some(motion, others), some(simulate_many(fleet, INITIAL, surroundings, TIMES, **given), others))
    alone = eqx.tree_at(lambda c: c.inertia, CRAFT, jnp.asarray(triangle))
    with pytest.raises(ValueError, match="simulate_many: spacecraft.inertia: no body has"):
        simulate_many(alone, INITIAL, surroundings, TIMES, **given)


def test_motion_that_overflows_is_lost_too(whole):
    motion = at_step(broken(angular_velocity=(4, 1e200)))
    assert motion.diverged == (4,)
    assert_same(some(motion, range(4)), some(whole, range(4)))


@pytest.mark.parametrize("tolerance", [0.0, 1.0, 2.0, np.nan])
def test_tolerances_that_are_none(tolerance):
    with pytest.raises(ValueError, match="tolerance must be between 0 and 1 rad"):
        simulate_many(CRAFT, INITIAL, surroundings, TIMES, tolerance=tolerance)


@pytest.mark.parametrize("times", [[1.0, 3.0, 2.0], [-1.0, 1.0]])
def test_times_that_turn_round(times):
    with pytest.raises(ValueError, match="times must run in one direction"):
        at_step(times=np.array(times))


def test_single_precision(whole):
    """Where JAX is told to work in 32 bits: hundreds of roundings, each grown by weights of the method up to 75."""
    sizes = jax.tree.map(np.asarray, (CRAFT, INITIAL))
    jax.config.update("jax_enable_x64", False)
    try:
        craft, initial = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), sizes)
        with pytest.raises(ValueError, match=r"are float32, .* a tolerance of 0.001 rad or more, got 1e-06"):
            simulate_many(craft, initial, surroundings, TIMES, max_step=STEP)
        motion = simulate_many(craft, initial, surroundings, TIMES, max_step=STEP, tolerance=1e-3, chunk=CHUNK)
        assert {leaf.dtype for leaf in jax.tree.leaves(motion)} == {jnp.dtype(jnp.float32)}
    finally:
        jax.config.update("jax_enable_x64", True)
    error = apart(np.asarray(motion.quaternion, float), whole.quaternion).max()
    assert 1e-8 < error < 2000 * np.finfo(np.float32).eps
