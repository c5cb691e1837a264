"""Hysteresis rods on any axes damp a tumbling satellite as Flatley & Henretty's law in B and H does, by scipy."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate, simulate_on_grid
from jaxsat.spacecraft import HysteresisRods, Spacecraft
from jaxsat.torques import lag_from_induction

MU0 = 1.25663706127e-6
AXES = np.array([[1.0, 0.0, 0.0], [0.36, 0.48, 0.8], [-0.6, 0.64, -0.48]])
"""Neither along the body's axes nor across each other."""
VOLUMES = np.array([3.0e-7, 2.0e-7, 4.0e-7])
HC, BR, BS = np.array([8.0, 7.0, 9.0]), np.array([0.02, 0.018, 0.022]), np.array([0.06, 0.055, 0.065])
INERTIA = np.diag([1.5e-3, 1.7e-3, 1.9e-3])
FIELD = np.array([2.1e-5, -1.4e-5, 2.8e-5])
MAGNET = np.array([0.05, 0.01, -0.02])
Q, W = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_quat(scalar_first=True), np.array([0.05, -0.08, 0.06])
TIMES = np.arange(20.0, 201.0, 20.0)
GRID = StepGrid.through(TIMES, start=0.0, max_step=1.0)
COUNT = len(GRID.node_times)
TABLE = OrbitTable(
    *(jnp.tile(jnp.asarray(x), (COUNT, 1)) for x in ([1e12, 0.0, 0.0], FIELD)), b_rate_eci=jnp.zeros((COUNT, 3))
)


def truth(magnet=(0.0, 0.0, 0.0)):
    """Attitudes and rates at the times: the state is B of each rod, its slope over H that of the published law."""

    def slope(t, y):
        q, w, b = y[:4], y[4:7], y[7:]
        field = Rotation.from_quat(q, scalar_first=True).inv().apply(FIELD)
        h, h_dot = AXES @ field / MU0, AXES @ np.cross(field, w) / MU0
        k = np.tan(0.5 * np.pi * BR / BS) / HC
        behind = np.tan(0.5 * np.pi * b / BS) / k - np.sign(h_dot) * HC
        share = np.clip(np.sign(h_dot) * (h - behind) / (2.0 * HC), 0.0, 1.0) ** 2
        b_dot = share * 2.0 / np.pi * k * BS * np.cos(0.5 * np.pi * b / BS) ** 2 * h_dot
        torque = np.cross((VOLUMES * b / MU0) @ AXES + magnet, field)
        w_dot = np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))
        q_dot = 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])
        return np.concatenate([q_dot, w_dot, b_dot])

    # Demagnetised rods, which in a field above Hc is outside the loops.
    start = np.concatenate([Q, W, np.zeros(3)])
    # Short enough for the kinks where a field turns.
    found = solve_ivp(slope, (0.0, TIMES[-1]), start, "DOP853", TIMES, rtol=1e-10, atol=1e-12, max_step=0.1)
    return found.y[:4].T, found.y[4:7].T


def motion(scales):
    """With Hc, Br and Bs of each rod, and its volume, over those above [4 3]."""
    hc, br, bs, volumes = scales * jnp.asarray(np.array([HC, BR, BS, VOLUMES]))
    rods = HysteresisRods(jnp.asarray(AXES), volumes, hc, br, bs)
    field = jnp.asarray(Rotation.from_quat(Q, scalar_first=True).inv().apply(FIELD))
    initial = AttitudeState(jnp.asarray(Q), jnp.asarray(W), lag_from_induction(rods, jnp.zeros(3), field))
    return simulate_on_grid(Spacecraft(jnp.asarray(INERTIA), hysteresis_rods=rods), initial, TABLE, GRID)


def test_motion_is_that_of_the_law_in_its_own_variable():
    found, (q, w) = jax.jit(motion)(jnp.ones((4, 3))), truth()
    apart = Rotation.from_quat(np.asarray(found.quaternion), scalar_first=True).inv() * Rotation.from_quat(
        q, scalar_first=True
    )
    # Fourth order, of RK4 and at the turns of each rod's field alike: 2.2e-6 rad at 1 s, 3.5e-5 at 2 s.
    assert apart.magnitude().max() < 3e-6
    np.testing.assert_allclose(found.angular_velocity, w, atol=2e-8)
    # What the rods do is worth two hundred thousand times that.
    free = jax.jit(motion)(jnp.ones((4, 3)).at[3].set(0.0))
    assert np.abs(np.asarray(free.angular_velocity) - w).max() > 4e-3


def constant(times):
    """The table above at any times."""
    place, field = (jnp.tile(jnp.asarray(x), (len(times), 1)) for x in ([1e12, 0.0, 0.0], FIELD))
    return OrbitTable(place, field)


def test_error_is_stated_across_all_turns_and_the_energy_book_closes():
    """By steps that end at the turns: what the motion loses is the heat of the loops, B being that of the law."""
    rods = HysteresisRods(jnp.asarray(AXES), VOLUMES, HC, BR, BS)
    field = Rotation.from_rotvec([0.4, -0.7, 1.1]).inv().apply(FIELD)
    initial = AttitudeState(jnp.asarray(Q), jnp.asarray(W), lag_from_induction(rods, jnp.zeros(3), jnp.asarray(field)))
    craft = Spacecraft(jnp.asarray(INERTIA), jnp.asarray(MAGNET), hysteresis_rods=rods)
    motion = simulate(craft, initial, constant, TIMES, tolerance=1e-7)
    attitudes, (q, w) = Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True), truth(MAGNET)
    apart = (attitudes.inv() * Rotation.from_quat(q, scalar_first=True)).magnitude().max()
    # Scipy's own error, kinks not being ends of its steps, is 2e-8 rad.
    assert motion.error is not None and apart <= motion.error + 2e-8 <= 1.2e-7
    np.testing.assert_allclose(motion.angular_velocity, w, atol=1e-8)

    rates, field = np.asarray(motion.angular_velocity), attitudes.inv().apply(FIELD)
    h, k = field @ AXES.T / MU0, np.tan(0.5 * np.pi * BR / BS) / HC
    induction = 2.0 / np.pi * BS * np.arctan(k * (h - HC * np.asarray(motion.rod_lag)))
    # In a field that stands still magnet and rods have the energies -m B and -V B H, and V H dB is what they take.
    energy = 0.5 * np.einsum("ti,ij,tj->t", rates, INERTIA, rates) - field @ MAGNET - induction * h @ VOLUMES
    before = 0.5 * W @ INERTIA @ W - Rotation.from_quat(Q, scalar_first=True).inv().apply(FIELD) @ MAGNET
    assert motion.rod_heat is not None
    heat = np.asarray(motion.rod_heat)
    np.testing.assert_allclose(before - energy, heat.sum(axis=1), atol=1e-7 * heat[-1].sum())
    assert heat[-1].min() > 0.0 and heat[-1].sum() > 0.02 * 0.5 * W @ INERTIA @ W


def test_slopes_by_every_rod_are_differences():
    def end(flat):
        found = motion(flat.reshape(4, 3))
        return jnp.concatenate([found.quaternion[-1], found.angular_velocity[-1]])

    x, h = np.ones(12), 1e-4
    slopes = np.asarray(jax.jit(jax.jacfwd(end))(x))
    ends = jax.jit(jax.vmap(end))
    differences = (np.asarray(ends(x + h * np.eye(12))) - np.asarray(ends(x - h * np.eye(12)))).T / (2.0 * h)
    assert np.all(np.isfinite(slopes)) and np.all(np.abs(slopes).max(axis=0) > 1e-4)
    # A turn of the field that passes from one step to the next as a number changes leaves a jump of the error there.
    np.testing.assert_allclose(slopes, differences, atol=2e-5 * np.abs(slopes).max())
