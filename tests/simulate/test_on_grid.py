"""Trajectories: closed-form precession, conserved quantities, order of the method, and slopes against differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import KeplerOrbit, OrbitTable, igrf_field, tabulate_orbit
from jaxsat.integrators import BLOCK, DORMAND_PRINCE_8, RK4, AdamsGrid, StepGrid
from jaxsat.simulate import simulate_on_grid
from jaxsat.spacecraft import HysteresisRods, MagneticRods, SolarPanels, Spacecraft, box_normals

INERTIA = np.array([[0.0514, 0.0014, -0.0022], [0.0014, 0.0549, 0.0011], [-0.0022, 0.0011, 0.0578]])
Q0 = Rotation.from_rotvec([0.7, -1.1, 0.4])
W0 = np.array([0.021, -0.013, 0.017])


def craft_with(inertia):
    rods = MagneticRods(jnp.asarray([0.035, 0.025]), jnp.eye(3)[1:], jnp.asarray(3.0e-5))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    return Spacecraft(jnp.asarray(inertia), jnp.asarray([0.3, 0.004, -0.01]), rods, panels)


def start(q=Q0, w=W0):
    return AttitudeState(jnp.asarray(q.as_quat(scalar_first=True)), jnp.asarray(w))


move = eqx.filter_jit(simulate_on_grid)


def free_motion(inertia, times, max_step, pad_steps=BLOCK):
    grid = StepGrid.through(times, start=0.0, max_step=max_step, pad_steps=pad_steps)
    nodes = len(grid.node_times)
    table = OrbitTable(jnp.tile(jnp.asarray([7e6, 0, 0]), (nodes, 1)), jnp.zeros((nodes, 3)))
    motion = move(craft_with(inertia), start(), table, grid, torques=())
    return Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True), np.asarray(motion.angular_velocity)


TIMES = np.linspace(25.0, 1000.0, 40)


@pytest.mark.parametrize("axial", [0.03, 0.09], ids=["prolate", "oblate"])
def test_free_precession_of_a_symmetric_body(axial):
    """Turn about h at |h|/J_t after a turn about the body's axis at w_z (1 - J_z/J_t) (Goldstein 1980, sec. 5-6)."""
    transverse = 0.05
    tensor = np.diag([transverse, transverse, axial])
    attitudes, rates = free_motion(tensor, TIMES, 0.5)
    momentum = Q0.apply(tensor @ W0)
    spin = W0[2] * (1 - axial / transverse)
    precession = Rotation.from_rotvec(TIMES[:, None] * momentum / transverse)
    expected = precession * Q0 * Rotation.from_rotvec(TIMES[:, None] * np.array([0.0, 0.0, spin]))
    # Bound of the method at |w| = 0.03 rad/s: (w/2)^5 h^4 1000 s / 60 = 8e-10, the precession somewhat faster.
    assert np.max((attitudes.inv() * expected).magnitude()) < 2e-9
    back = Rotation.from_rotvec(-TIMES[:, None] * np.array([0.0, 0.0, spin]))
    np.testing.assert_allclose(rates, back.apply(W0), atol=2e-11)


def test_energy_and_momentum_of_a_tumbling_body_are_kept():
    attitudes, rates = free_motion(INERTIA, TIMES, 0.5)
    momentum = attitudes.apply(rates @ INERTIA)
    energy = 0.5 * np.sum(rates @ INERTIA * rates, axis=1)
    np.testing.assert_allclose(np.linalg.norm(attitudes.as_quat(), axis=1), 1.0, rtol=1e-15)
    # Drifts of the method after 30 rad of tumbling in steps of 0.015 rad: 1.2e-11 and 8e-15 are measured.
    h0, e0 = Q0.apply(INERTIA @ W0), 0.5 * W0 @ INERTIA @ W0
    assert np.max(np.linalg.norm(momentum - h0, axis=1)) < 5e-11 * np.linalg.norm(h0)
    assert np.max(np.abs(energy / e0 - 1)) < 1e-13


ORBIT = KeplerOrbit(7630.026457e3, 0.072661, 1.6657226, 1.1313013, 0.2910495, -3.0602300)
FIELD = igrf_field(2001.05, degree=2)
tabulate = eqx.filter_jit(tabulate_orbit)


def laid(times, *, start=0.0, max_step=10.0, pad_samples=2, pad_steps=512, tableau=RK4):
    """Grid and table; all of one shape, so that the programs are compiled once."""
    grid = StepGrid.through(
        np.array(times),
        start=start,
        max_step=max_step,
        tableau=tableau,
        pad_samples=pad_samples,
        pad_steps=pad_steps,
    )
    return grid, tabulate(ORBIT, jnp.asarray(grid.node_times), FIELD, 3.3376)


GRID, TABLE = laid([100.0, 240.0])


def test_order_four_with_all_torques():
    ends = []
    for steps in (16, 32, 64, 512):
        grid, table = laid([200.0, 400.0], max_step=400 / steps)
        motion = move(craft_with(INERTIA), start(), table, grid)
        ends.append(Rotation.from_quat(np.asarray(motion.quaternion[1]), scalar_first=True))
    error = np.array([(ends[-1].inv() * end).magnitude() for end in ends[:-1]])
    np.testing.assert_allclose(np.log2(error[:-1] / error[1:]), 4.0, atol=0.2)


@pytest.mark.slow
def test_order_eight_meets_order_four():
    """Two methods: eight steps of 50 s of one against 512 of 0.8 s of the other."""
    grid, table = laid([200.0, 400.0], max_step=400 / 512)
    fine = move(craft_with(INERTIA), start(), table, grid)
    errors = []
    for steps in (8, 16):
        grid, table = laid([200.0, 400.0], max_step=400 / steps, pad_steps=16, tableau=DORMAND_PRINCE_8)
        motion = move(craft_with(INERTIA), start(), table, grid, tableau=DORMAND_PRINCE_8)
        assert motion.grid is not None and motion.grid.step.shape == (16,)
        errors.append(np.abs(np.asarray(motion.quaternion) - np.asarray(fine.quaternion)).max())
    # RK4 itself: (0.015)^5 0.8^4 400 / 60 = 2e-9, the motion's rate being 0.03 rad/s.
    assert errors[0] < 1e-5 and errors[1] < 1e-8
    assert errors[0] > 100 * errors[1]


@pytest.mark.slow
def test_grid_of_another_method_is_refused():
    """A grid for order eight has ten inner nodes a step: order four would read its table at wrong times."""
    grid, table = laid([200.0, 400.0], max_step=50.0, pad_steps=16, tableau=DORMAND_PRINCE_8)
    with pytest.raises(ValueError):
        simulate_on_grid(craft_with(INERTIA), start(), table, grid, torques=())
    with pytest.raises(ValueError):
        simulate_on_grid(craft_with(INERTIA), start(), TABLE, GRID, torques=(), tableau=DORMAND_PRINCE_8)


def test_backward_returns_to_the_start():
    motion = move(craft_with(INERTIA), start(), TABLE, GRID)
    back, table = laid([100.0, 0.0], start=240.0)
    final = AttitudeState(motion.quaternion[1], motion.angular_velocity[1])
    there = move(craft_with(INERTIA), final, table, back)
    # The method's own error at h = 10 s, (0.03/2)^5 10^4 240 / 60 = 3e-5, mostly undone on the way back.
    np.testing.assert_allclose(there.quaternion[0], motion.quaternion[0], atol=1e-5)
    np.testing.assert_allclose(there.quaternion[1], Q0.as_quat(scalar_first=True), atol=1e-5)
    np.testing.assert_allclose(there.angular_velocity[1], W0, atol=2e-7)


def test_blocks_and_scan_agree_to_the_last_bits():
    whole = move(craft_with(INERTIA), start(), TABLE, GRID)
    part = move(craft_with(INERTIA), start(), TABLE, GRID, blocks=jnp.asarray(6))
    np.testing.assert_allclose(part.quaternion, whole.quaternion, rtol=0, atol=4e-16)
    np.testing.assert_allclose(part.angular_velocity, whole.angular_velocity, rtol=0, atol=1e-17)
    # Three blocks reach 120 s: the first sample is there, the second one is not.
    short = move(craft_with(INERTIA), start(), TABLE, GRID, blocks=jnp.asarray(3))
    np.testing.assert_array_equal(short.quaternion[0], part.quaternion[0])
    np.testing.assert_array_equal(short.quaternion[1], Q0.as_quat(scalar_first=True))


def test_samples_may_stand_at_the_start_and_be_padded():
    grid, table = laid([0.0, 30.0], pad_samples=4)
    motion = move(craft_with(INERTIA), start(), table, grid)
    np.testing.assert_array_equal(motion.quaternion[0], Q0.as_quat(scalar_first=True))
    np.testing.assert_array_equal(motion.angular_velocity[0], W0)
    np.testing.assert_array_equal(motion.quaternion[2:], np.tile(motion.quaternion[1], (2, 1)))


# One direction of change for each thing that a fit may free, of about its own size.
INERTIA_CHANGE = 0.01 * np.array([[1, 0.1, 0], [0.1, -1, 0.2], [0, 0.2, 0]])
CHANGES = (
    (lambda pair: pair[1].angular_velocity, np.full(3, 0.01)),
    (lambda pair: pair[0].inertia, INERTIA_CHANGE),
    (lambda pair: pair[0].magnet, np.array([0.1, 0.05, -0.1])),
    (lambda pair: pair[0].rods.moments, np.array([0.02, -0.02])),
)


def final_attitude(changes, blocks=None, run=simulate_on_grid):
    pair = (craft_with(INERTIA), start())
    for k, (where, change) in enumerate(CHANGES):
        pair = eqx.tree_at(where, pair, where(pair) + changes[k] * jnp.asarray(change))
    return run(pair[0], pair[1], TABLE, GRID, blocks=blocks).quaternion[1]


@pytest.fixture(scope="module")
def difference():
    """Central differences of the final attitude, [4, changes]; the steps are common to a family, in units of it."""
    h = 1e-4
    ends = [[np.asarray(final_attitude(s * h * e, run=move)) for s in (1, -1)] for e in jnp.eye(4)]
    return np.stack([(plus - minus) / (2 * h) for plus, minus in ends], axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["forward through blocks", "reverse through the scan"])
def test_slopes_of_the_final_attitude(way, difference):
    if way.startswith("forward"):
        slope = jax.jit(jax.jacfwd(lambda x: final_attitude(x, blocks=jnp.asarray(6))))(jnp.zeros(4))
    else:
        slope = jax.jit(jax.jacrev(final_attitude))(jnp.zeros(4))
    slope = np.asarray(slope)
    # Every change moves the attitude visibly.
    assert np.all(np.linalg.norm(slope, axis=0) > 1e-3)
    # Truncation h^2 times third derivatives of order one, rounding eps / h = 2e-12.
    np.testing.assert_allclose(slope, difference, atol=2e-8)


@pytest.mark.slow
def test_checkpoints_change_neither_motion_nor_slope():
    """The slope of a scalar loss, the steps of a grid without padding being 24 and no multiple of 10."""
    grid, table = laid([100.0, 240.0], pad_steps=1)
    assert grid.step.shape == (24,)

    def loss(w, every):
        initial = AttitudeState(start().quaternion, w)
        motion = simulate_on_grid(craft_with(INERTIA), initial, table, grid, torques=(), checkpoint_every=every)
        return jnp.sum(motion.quaternion[:, 0] ** 2 + 100.0 * motion.angular_velocity[:, 1])

    (plain, slope), (value, found) = (jax.jit(jax.value_and_grad(lambda w, k=k: loss(w, k)))(W0) for k in (None, 10))
    np.testing.assert_allclose(value, plain, rtol=1e-14)
    np.testing.assert_allclose(found, slope, rtol=1e-11)
    assert np.abs(slope).min() > 1.0


def test_state_of_the_rods_goes_along():
    """A rod in a field that grows along it from nothing leaves the boundary loop behind by its own law."""
    mu0, hc, rate = 1.25663706127e-6, 12.0, 2e-8
    rods = HysteresisRods(np.eye(3)[:1], np.array([1e-7]), np.array([hc]), np.array([0.004]), np.array([0.025]))
    craft = eqx.tree_at(lambda c: c.hysteresis_rods, craft_with(INERTIA), rods, is_leaf=lambda x: x is None)
    grid = StepGrid.through(np.array([0.0, 300.0, 900.0]), start=0.0, max_step=10.0)
    t = jnp.asarray(grid.node_times)[:, None]
    along = jnp.asarray([[1.0, 0.0, 0.0]])
    table = OrbitTable(7e6 * along + 0.0 * t, rate * along * t, rate * along + 0.0 * t)
    still = AttitudeState(jnp.asarray([1.0, 0, 0, 0]), jnp.zeros(3), jnp.asarray([-1.0]))
    motion = move(craft, still, table, grid, torques=())
    # p = 2 and q0 = 0: dz/dx = 1 - (1 + z)^2 / 4 with x = H / Hc, from z = -1: z = 2 tanh(x / 2) - 1.
    x = rate * np.array([0.0, 300.0, 900.0]) / mu0 / hc
    np.testing.assert_allclose(np.asarray(motion.rod_lag)[:, 0], 2 * np.tanh(x / 2) - 1, atol=1e-8)
    np.testing.assert_array_equal(motion.quaternion, np.eye(4)[:1].repeat(3, axis=0))
    assert move(craft_with(INERTIA), start(), TABLE, GRID).rod_lag is None


@pytest.mark.slow
def test_slopes_are_finite_from_rest():
    def end(w):
        return simulate_on_grid(
            craft_with(INERTIA), AttitudeState(start().quaternion, w), TABLE, GRID, torques=()
        ).quaternion

    slope = jax.jit(jax.jacfwd(end))(jnp.zeros(3))
    # A slow rate turns the body by w t: dq/dw = q (0, w) t / 2.
    basis = np.stack([(Q0 * Rotation.from_quat([*e, 0.0])).as_quat(scalar_first=True) for e in np.eye(3)], axis=-1)
    np.testing.assert_allclose(slope, np.array([100.0, 240.0])[:, None, None] / 2 * basis, atol=1e-11)


def test_many_satellites_at_once():
    rates = jnp.asarray(np.stack([W0, 0.5 * W0, -W0]))
    run = jax.jit(
        jax.vmap(
            lambda w: (
                simulate_on_grid(craft_with(INERTIA), AttitudeState(start().quaternion, w), TABLE, GRID).quaternion
            )
        )
    )
    together = run(rates)
    for k, rate in enumerate(rates):
        alone = move(craft_with(INERTIA), AttitudeState(start().quaternion, rate), TABLE, GRID).quaternion
        np.testing.assert_allclose(together[k], alone, atol=1e-14)


@pytest.mark.slow
def test_cases_in_front_are_as_one_by_one():
    """On an Adams grid: the motions of three states, and the slopes of all their final attitudes."""
    grid = AdamsGrid.through(np.array([30.0, 90.0]), start=0.0, max_step=2.0)
    table = tabulate(ORBIT, jnp.asarray(grid.node_times), FIELD, 3.3376)
    turns = [Q0 * Rotation.from_rotvec([0.0, 0.3 * k, 0.0]) for k in range(3)]
    states = [start(q, (1.0 + 0.1 * k) * W0) for k, q in enumerate(turns)]
    together = jax.tree.map(lambda *leaves: jnp.stack(leaves), *states)
    craft = craft_with(INERTIA)

    def final(state, magnet):
        changed = eqx.tree_at(lambda c: c.magnet, craft, magnet)
        return simulate_on_grid(changed, state, table, grid).quaternion[..., -1, :]

    def loss(magnet):
        ends = final(together, magnet)
        return jnp.sum(ends @ jnp.arange(4.0)), ends

    slope, found = jax.jit(jax.grad(loss, has_aux=True))(craft.magnet)
    alone = jax.jit(jax.value_and_grad(lambda m, state: jnp.sum(final(state, m) * jnp.arange(4.0))))
    expected = [alone(craft.magnet, state) for state in states]
    np.testing.assert_allclose(found @ jnp.arange(4.0), [value for value, _ in expected], atol=1e-13)
    total = np.sum([np.asarray(each) for _, each in expected], axis=0)
    assert np.abs(total).max() > 0.1
    np.testing.assert_allclose(slope, total, rtol=1e-11)
