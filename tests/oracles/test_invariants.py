"""What a motion keeps: energy, momentum and Jacobi's integral over one orbit, and by how much each method drifts.

A bound on a drift says something if it sees a wrong torque: each invariant is also formed with every term in turn
wrong by a millionth, and must then drift beyond the bound.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import DORMAND_PRINCE_8, RK4, StepGrid
from jaxsat.simulate import simulate_many, simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals

MU, RADIUS, REFERENCE = 3.986004415e14, 7.0e6, 3.0e-5
N = np.sqrt(MU / RADIUS**3)
ORBIT = 2 * np.pi / N
TIMES = ORBIT / 40 * np.arange(1, 41)
INERTIA = np.array([[0.0314, 0.0044, -0.0052], [0.0044, 0.0549, 0.0061], [-0.0052, 0.0061, 0.0578]])
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.28, 0.96]])
FRAME = Rotation.from_rotvec([0.3, 0.8, -0.5]).as_matrix()
"""Its columns are the orbit's frame at t = 0: radial, along track, normal."""
FIELD = np.array([1.1e-5, -2.3e-5, 1.4e-5])
"""Constant in the orbit's frame, so that Jacobi's integral covers magnet and rods too [T]."""
CASES = 6


class Circle(eqx.Module):
    """A circular orbit in a field that turns with it."""

    radius: jax.Array
    rate: jax.Array

    def __call__(self, times):
        c, s, zero = jnp.cos(self.rate * times), jnp.sin(self.rate * times), jnp.zeros_like(times)
        radial, along = jnp.stack([c, s, zero], axis=1) @ FRAME.T, jnp.stack([-s, c, zero], axis=1) @ FRAME.T
        b_field = FIELD[0] * radial + FIELD[1] * along + (FIELD[2] * FRAME[:, 2])[None]
        return OrbitTable(self.radius * radial, b_field)


class System(eqx.Module):
    """A satellite, its first states, and where it is."""

    craft: Spacecraft
    initial: AttitudeState
    place: Circle


def system(magnet, moments, spin, radius, rate):
    rng = np.random.default_rng(5)
    rods = MagneticRods(jnp.asarray(moments * np.array([1.0, 0.7])), jnp.asarray(AXES), jnp.asarray(REFERENCE))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    craft = Spacecraft(jnp.asarray(INERTIA), jnp.asarray(magnet * np.array([0.8, -0.36, 0.48])), rods, panels)
    q = Rotation.random(CASES, rng=rng).as_quat(scalar_first=True)
    initial = jax.vmap(AttitudeState)(jnp.asarray(q), jnp.asarray(spin * rng.normal(size=(CASES, 3))))
    return System(craft, initial, Circle(jnp.asarray(radius), jnp.asarray(rate)))


# A magnet of 1e-30 A m^2, not zero, and a place where no gravity gradient is felt: all share one program.
FAR = 1e15
SYSTEMS = {
    "free": system(magnet=1e-30, moments=1e-30, spin=0.006, radius=FAR, rate=0.0),
    "in a constant field": system(magnet=0.03, moments=0.02, spin=0.003, radius=FAR, rate=0.0),
    "on a circular orbit": system(magnet=1e-3, moments=1e-3, spin=0.001, radius=RADIUS, rate=N),
}
"""Spins up to 0.015, 0.007 and 0.002 rad/s; on the orbit all torques are about equally strong."""

by_runge_kutta = eqx.filter_jit(
    eqx.filter_vmap(
        lambda initial, craft, table, grid, tableau: simulate_on_grid(craft, initial, table, grid, tableau=tableau),
        in_axes=(0, None, None, None, None),
    )
)


def motion(satellites, tableau, step):
    """Attitudes and rates [cases, samples, ...] over the orbit, those at the start included; no tableau means Adams."""
    initial, craft, place = satellites.initial, satellites.craft, satellites.place
    if tableau is None:
        found = simulate_many(craft, initial, place, TIMES, max_step=step)
    else:
        # One number of steps for a method, one program.
        pad = 2960 if tableau is RK4 else 640
        grid = StepGrid.through(TIMES, start=0.0, max_step=step, tableau=tableau, pad_steps=pad)
        grid = jax.tree.map(jnp.asarray, grid)
        found = by_runge_kutta(initial, craft, place(grid.node_times), grid, tableau)
    q = np.concatenate([initial.quaternion[:, None], found.quaternion], axis=1)
    return q, np.concatenate([initial.angular_velocity[:, None], found.angular_velocity], axis=1)


TERMS = {
    "free": ("inertia",),
    "in a constant field": ("inertia", "magnet", "rods"),
    "on a circular orbit": ("inertia", "gradient", "magnet", "rods"),
}


def kept(name, q, w, wrong=None):
    """What each case keeps [kinds, cases, samples], over its scale; `wrong` names a term made 1e-6 too large."""
    craft, place = SYSTEMS[name].craft, SYSTEMS[name].place
    factor = {term: 1.0 + 1e-6 * (term == wrong) for term in TERMS["on a circular orbit"]}
    turn = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True)

    def body(v_eci):
        return turn.inv().apply(np.tile(v_eci, (CASES, 1))).reshape(w.shape)

    momentum = w @ (INERTIA * np.array([[factor["inertia"], 1, 1], [1, 1, 1], [1, 1, 1]]))
    energy = 0.5 * np.sum(momentum * w, axis=-1)
    if name == "free":
        inertial = np.moveaxis(turn.apply(momentum.reshape(-1, 3)).reshape(w.shape), -1, 0)
        return np.stack([energy / energy.mean(), *inertial / np.linalg.norm(momentum, axis=-1).mean()])

    table, n = place(np.concatenate([[0.0], TIMES])), float(place.rate)
    e, b = body(np.asarray(table.position_eci) / float(place.radius)), body(np.asarray(table.b_field_eci))
    normal = body(np.tile(FRAME[:, 2], (len(TIMES) + 1, 1)))
    assert craft.rods is not None
    magnet = -b @ np.asarray(craft.magnet)
    rods = -0.5 * (b @ AXES.T) ** 2 @ np.asarray(craft.rods.moments) / REFERENCE
    gradient = 1.5 * n**2 * np.sum(e @ INERTIA * e, axis=-1)
    # Jacobi's integral: energy less the orbital rate times the momentum along the orbit's normal (Hughes 2004, ch. 9).
    total = energy - n * np.sum(normal * momentum, axis=-1)
    total = total + factor["gradient"] * gradient + factor["magnet"] * magnet + factor["rods"] * rods
    return total[None] / (np.abs(energy).mean() + np.abs(magnet).mean() + np.abs(rods).mean() + np.ptp(gradient))


def drift(name, q, w, wrong=None):
    """Largest change over the orbit of what each case keeps, [cases]."""
    values = kept(name, q, w, wrong)
    return np.max(np.abs(values - values[..., :1]), axis=(0, 2))


METHODS = {"RK4": RK4, "Dormand-Prince 8": DORMAND_PRINCE_8, "Adams": None}
BOUNDS = {
    ("RK4", 2.0): (3e-9, 2e-9, 7e-12),
    ("RK4", 5.0): (1e-7, 5e-8, 2.5e-10),
    ("Dormand-Prince 8", 10.0): (1e-13, 1e-13, 1e-13),
    ("Dormand-Prince 8", 20.0): (1e-12, 5e-13, 1e-13),
    ("Adams", 6.0): (4e-13, 3e-12, 1e-13),
    ("Adams", 10.0): (2.5e-11, 1.4e-10, 1e-13),
}
"""Relative drift in one orbit of 5829 s: free, in a constant field, on a circular orbit. Twice what was measured, the
methods' own and falling with their order; 1e-13 is rounding, 1e-16 in each of 600 to 1200 steps."""


@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize(("method", "step"), BOUNDS)
def test_drift_in_one_orbit(method, step, name):
    q, w = motion(SYSTEMS[name], METHODS[method], step)
    bound = BOUNDS[method, step][list(SYSTEMS).index(name)]
    assert np.max(drift(name, q, w)) < bound
    # A millionth more of any term, in the case that feels it least, would show.
    for term in TERMS[name]:
        assert np.min(drift(name, q, w, term)) > 2.0 * bound, term
    np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1.0, rtol=1e-15)
