"""Derivatives of the motion by first state, magnet, rods and inertia against complex steps and differences.

The oracle is NumPy: its own right-hand side, run with complex numbers through its own loop over short steps of order
eight, which gives derivatives to the last digits, and through scipy's DOP853 for differences.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import DOP853, solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import DORMAND_PRINCE_8, RK4, AdamsGrid, StepGrid
from jaxsat.math import quaternion
from jaxsat.simulate import Sensitivities, simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals, symmetric_tensor

pytestmark = pytest.mark.slow

MU, REFERENCE, DURATION = 3.986004415e14, 3.0e-5, 400.0
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.28, 0.96]])


def environment(t, xp=np):
    """Position [m] and field [T] along some path, smooth functions of time, [..., 3]."""
    c, s = xp.cos(1.1e-3 * t), xp.sin(1.1e-3 * t)
    position = 7e6 * xp.stack([0.8 * c - 0.36 * s, 0.6 * c + 0.48 * s, 0.8 * s], axis=-1)
    return position, 3e-5 * xp.stack([0.5 * c + 0.2, -0.7 * s - 0.4, 0.6 * c * s + 0.3], axis=-1)


# What is varied, in units of its own size: turn, rate, magnet, rods, inertia (xx, yy, zz, xy, xz, yz).
SIZES = np.concatenate([np.ones(3), np.full(3, 0.01), np.full(3, 0.1), np.full(2, 0.02), np.full(6, 0.01)])
SATELLITE = np.array([0.3, 0.04, -0.1, 0.035, 0.025, 0.0514, 0.0549, 0.0578, 0.0014, -0.0022, 0.0011])
Q0 = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_quat(scalar_first=True)
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
POINTS = {
    "tumbling": (Q0, [0.013, -0.004, 0.021]),
    "tumbling from the identity": (IDENTITY, [0.013, -0.004, 0.021]),
    "from rest": (Q0, [0.0, 0.0, 0.0]),
    "from rest at the identity": (IDENTITY, [0.0, 0.0, 0.0]),
}


def textbook(q, w, own, position, field):
    """Slopes of q and w for arrays of cases [cases, ...], analytic in all arguments; `own` as SATELLITE."""
    q0, q1, q2, q3 = q.T
    rows = [
        [q0**2 + q1**2 - q2**2 - q3**2, 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)],
        [2 * (q1 * q2 + q0 * q3), q0**2 - q1**2 + q2**2 - q3**2, 2 * (q2 * q3 - q0 * q1)],
        [2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), q0**2 - q1**2 - q2**2 + q3**2],
    ]
    eci_from_body = np.array(rows).transpose(2, 0, 1)
    r, b = position @ eci_from_body, field @ eci_from_body
    xx, yy, zz, xy, xz, yz = own[:, 5:].T
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
    dipole = own[:, :3] + (own[:, 3:5] * (b @ AXES.T) / REFERENCE) @ AXES
    size = np.sqrt(np.sum(r * r, axis=1))[:, None]
    torque = 3 * MU / size**5 * np.cross(r, times(inertia, r)) + np.cross(dipole, b)
    w_dot = np.linalg.solve(inertia, (torque - np.cross(w, times(inertia, w)))[:, :, None])[:, :, 0]
    x, y, z = w.T
    q_dot = 0.5 * np.array(
        [-q1 * x - q2 * y - q3 * z, q0 * x + q2 * z - q3 * y, q0 * y + q3 * x - q1 * z, q0 * z + q1 * y - q2 * x]
    )
    return np.concatenate([q_dot.T, w_dot], axis=1)


def times(tensors, vectors):
    return np.einsum("nij,nj->ni", tensors, vectors)


def starts(point, changes):
    """First states and satellites of cases that differ from a point by `changes` [cases, 17]."""
    q, w = POINTS[point]
    p0, p1, p2, p3 = q
    vector = 0.5 * changes[:, :3]
    # q (1, turn / 2), brought to unit length: a turn to first order, analytic at zero.
    left = np.array([[p0, -p1, -p2, -p3], [p1, p0, -p3, p2], [p2, p3, p0, -p1], [p3, -p2, p1, p0]])
    turned = np.concatenate([np.ones((len(changes), 1)), vector], axis=1) @ left.T
    scaled = changes * SIZES
    return np.concatenate([unit(turned), w + scaled[:, 3:6]], axis=1), SATELLITE + scaled[:, 6:]


def unit(q):
    return q / np.sqrt(np.sum(q * q, axis=1))[:, None]


def complex_step(point, steps=100):
    """Jacobian [7, 17] of the last state, exact to rounding: no difference is formed."""
    y, own = starts(point, 1e-30j * np.eye(17))
    h = DURATION / steps
    for n in range(steps):
        slopes = []
        for row, c in zip(DOP853.A[:12], DOP853.C[:12], strict=True):
            stage = y + h * sum((a * k for a, k in zip(row, slopes, strict=False)), 0.0 * y)
            slopes.append(textbook(stage[:, :4], stage[:, 4:], own, *environment((n + c) * h)))
        y = y + h * sum(b * k for b, k in zip(DOP853.B, slopes, strict=True))
    return np.concatenate([unit(y[:, :4]), y[:, 4:]], axis=1).imag.T / 1e-30


def differences(point):
    """Jacobian by central differences of the fourth order of the exact motion."""
    h = 3e-3
    stencil = {1: 8 / 12, -1: -8 / 12, 2: -1 / 12, -2: 1 / 12}
    y, own = starts(point, np.concatenate([k * h * np.eye(17) for k in stencil]))

    def slope(t, flat):
        states = flat.reshape(y.shape)
        return textbook(states[:, :4], states[:, 4:], own, *environment(t)).ravel()

    solution = solve_ivp(slope, (0, DURATION), y.ravel(), method="DOP853", rtol=1e-13, atol=1e-15)
    ends = solution.y[:, -1].reshape(len(stencil), 17, 7)
    return np.tensordot(list(stencil.values()), ends, axes=1).T / h


def satellite(changes, q, w):
    """Satellite and first state of the library."""
    scaled = changes * SIZES
    own = SATELLITE + scaled[6:]
    rods = MagneticRods(own[3:5], jnp.asarray(AXES), jnp.asarray(REFERENCE))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    craft = Spacecraft(symmetric_tensor(own[5:]), own[:3], rods, panels)
    return craft, AttitudeState(quaternion.multiply(q, quaternion.from_rotation_vector(changes[:3])), w + scaled[3:6])


def last_state(changes, q, w, grid, table, tableau=RK4, checkpoint_every=None):
    """Attitude and rate at the end, by the library."""
    craft, first = satellite(changes, q, w)
    motion = simulate_on_grid(craft, first, table, grid, tableau=tableau, checkpoint_every=checkpoint_every)
    return jnp.concatenate([motion.quaternion[-1], motion.angular_velocity[-1]])


def laid(grid):
    """A grid and the table at its nodes."""
    grid = jax.tree.map(jnp.asarray, grid)
    position, b_field = environment(np.asarray(grid.node_times))
    return grid, OrbitTable(jnp.asarray(position), jnp.asarray(b_field))


END = np.array([DURATION])
RK4_GRID = laid(StepGrid.through(END, start=0.0, max_step=DURATION / 1600))
DP8_GRID = laid(StepGrid.through(END, start=0.0, max_step=DURATION / 100, tableau=DORMAND_PRINCE_8))
ADAMS_GRID = laid(AdamsGrid.through(END, start=0.0, max_step=DURATION / 200))
WAYS = {
    "RK4, forward": (jax.jacfwd, *RK4_GRID, RK4, None),
    "RK4, reverse with checkpoints": (jax.jacrev, *RK4_GRID, RK4, 37),
    "Dormand-Prince 8, reverse": (jax.jacrev, *DP8_GRID, DORMAND_PRINCE_8, None),
    "Adams, reverse": (jax.jacrev, *ADAMS_GRID, RK4, None),
}
# Steps of 0.01 rad: RK4 misses 3e-11 of the derivatives, as of the motion; the others are at rounding, 1e-13.
ACCURACY = {"RK4": 1e-10, "Dormand-Prince 8": 1e-12, "Adams": 1e-12}


@eqx.filter_jit
def jacobian(way, q, w):
    mode, *method = way
    return mode(lambda changes: last_state(changes, q, w, *method))(jnp.zeros(17))


def found(way, point):
    q, w = POINTS[point]
    return np.asarray(jacobian(WAYS[way], jnp.asarray(q), jnp.asarray(np.array(w))))


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("way", WAYS)
def test_derivatives_by_complex_step(way, point):
    expected = complex_step(point)
    # Rows are of different units, each row is seen against its largest element; everything that is varied matters.
    size = np.abs(expected).max(axis=1, keepdims=True)
    assert np.all(np.abs(expected / size).max(axis=0) > 3e-3)
    np.testing.assert_allclose(found(way, point) / size, expected / size, rtol=0, atol=ACCURACY[way.split(",")[0]])


@pytest.mark.parametrize("point", POINTS)
def test_derivatives_by_differences(point):
    """Truncation is h^4 / 30 times fifth derivatives of some hundreds, rounding 1e-13 / h."""
    expected = differences(point)
    size = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(found("Adams, reverse", point) / size, expected / size, rtol=0, atol=5e-9)


def asked(points):
    """Unknowns of `satellite`: no changes, attitude, rate."""
    return np.array([np.concatenate([np.zeros(17), *POINTS[point]]) for point in points])


@pytest.mark.parametrize("points", [list(POINTS)[:1], list(POINTS) * 2], ids=["few, tangents side by side", "many"])
def test_sensitivities_by_complex_step(points):
    ways = Sensitivities(
        lambda x: satellite(x[:17], x[17:21], x[21:]),
        lambda times: OrbitTable(*environment(times, jnp)),
        END,
        max_step=DURATION / 200,
    )
    found = ways(asked(points))
    for k, point in enumerate(points):
        expected = complex_step(point)
        size = np.abs(expected).max(axis=1, keepdims=True)
        got = np.concatenate([found.quaternion[k, 0, :, :17], found.angular_velocity[k, 0, :, :17]])
        np.testing.assert_allclose(got / size, expected / size, rtol=0, atol=ACCURACY["Adams"])
