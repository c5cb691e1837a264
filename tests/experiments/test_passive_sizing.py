"""Pieces of the study of passive satellites: swings of known period, heat of a loop by SciPy, settling by hand."""

import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipk

# Last, so that an installed jaxsat is the one under test.
sys.path.append(str(Path(__file__).parents[2]))

from experiments.sensitivity.passive_motion import DRAG_AREA, Numbers, Orbits, by_orbit, demagnetised
from experiments.sensitivity.passive_sizing import mass_g, settling_orbits, wobble
from jaxsat.environment import OrbitTable

MU0 = 1.25663706127e-6
FIELD, DIPOLE, MOMENT, STEPS = 3e-5, 0.1, 0.02, 1000
RELEASED = 1.0
"""From the field [rad]."""
PERIOD = 4.0 * ellipk(np.sin(0.5 * RELEASED) ** 2) / np.sqrt(DIPOLE * FIELD / MOMENT)
AIR_SPEED, AIR_DENSITY = 7500.0, 1e-12
HC, BR, BS, VOLUME = 12.0, 0.004, 0.025, 1e-6
TURNS, HEAVY = 4.0, 5.0


def constant_orbit():
    """A field and an air stream along inertial x, so far from the Earth that its pull has no gradient."""
    along = np.broadcast_to([1.0, 0.0, 0.0], (STEPS, 3, 3))
    zero = np.zeros((STEPS, 3, 3))
    # The air pushes against the velocity.
    table = OrbitTable(
        position_eci=jnp.asarray(1e12 * along),
        b_field_eci=jnp.asarray(FIELD * along),
        b_rate_eci=jnp.asarray(zero),
        air_velocity_eci=jnp.asarray(-AIR_SPEED * along),
        air_density=jnp.full((STEPS, 3), AIR_DENSITY),
    )
    return Orbits([table], PERIOD / STEPS, PERIOD)


def heat_of_the_law(rate):
    """Work on a rod along y of a field that goes round by `rate`: Flatley & Henretty's law for B itself, by SciPy."""
    k = np.tan(0.5 * np.pi * BR / BS) / HC
    h0 = FIELD / MU0

    def slope(t, y):
        h, h_rate = h0 * -np.sin(rate * t), -h0 * rate * np.cos(rate * t)
        effective = np.tan(0.5 * np.pi * y[0] / BS) / k
        boundary = 2.0 * BS / np.pi * k / (1.0 + (k * effective) ** 2)
        # From the boundary left behind, over the loop's width; held within 0 to 1.
        share = np.clip((h + np.sign(h_rate) * HC - effective) / (2.0 * HC) * np.sign(h_rate), 0.0, 1.0)
        b_rate = boundary * share**2 * h_rate
        return [b_rate, h * b_rate]

    found = solve_ivp(slope, (0.0, PERIOD), [0.0, 0.0], rtol=1e-9, atol=1e-12, max_step=PERIOD / 2000)
    return VOLUME * found.y[1, -1]


def test_swings_come_back_after_their_period_and_a_rod_takes_the_heat_of_its_loop():
    rate = TURNS * 2.0 * np.pi / PERIOD
    arm = DIPOLE * FIELD / (0.5 * DRAG_AREA * AIR_DENSITY * AIR_SPEED**2)
    numbers = Numbers(
        inertia=np.array([[0.01, MOMENT, MOMENT], [0.01, MOMENT, MOMENT], [HEAVY, HEAVY, HEAVY]]),
        dipole=np.array([DIPOLE, 0.0, 0.0]),
        volumes=np.array([[1e-30, 1e-30], [1e-30, 1e-30], [VOLUME, 1e-30]]),
        loop=np.tile([HC, BR, BS], (3, 1)),
        centre=np.array([[0.0, 0.0, 0.0], [arm, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    )
    turned = [np.cos(0.5 * RELEASED), 0.0, 0.0, np.sin(0.5 * RELEASED)]
    q = np.array([turned, turned, [1.0, 0.0, 0.0, 0.0]])
    w = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, rate]])
    orbits = constant_orbit()
    means, end = by_orbit(numbers, demagnetised(numbers, q, w, orbits), orbits, chunk=3)
    # A pendulum of the magnet, and one of the drag: back where they were let go. RK4 of a thousand steps.
    np.testing.assert_allclose(end.quaternion[:2], q[:2], atol=1e-7)
    np.testing.assert_allclose(end.angular_velocity[:2], 0.0, atol=1e-8)
    assert np.degrees(np.sqrt(means[0, 0, 0])) < np.degrees(RELEASED)
    # What the spin has lost is the heat of the loop, and what the rod keeps.
    lost = 0.5 * HEAVY * (rate**2 - end.angular_velocity[2, 2] ** 2)
    np.testing.assert_allclose(lost, heat_of_the_law(rate), rtol=2e-4)


def test_settling_and_wobble_by_hand():
    angles = np.array([[50.0, 9.0, 12.0, 8.0, 7.0], [50.0, 40.0, 30.0, 20.0, 10.0], [5.0, 4.0, 3.0, 2.0, 1.0]])
    assert settling_orbits(angles, 10.0).tolist() == [3.0, np.inf, 0.0]
    np.testing.assert_allclose(wobble(angles)[2], np.sqrt((16.0 + 9.0 + 4.0 + 1.0) / 4.0))


def test_masses_by_hand():
    # NdFeB of 1.2 T has a magnetisation of 954.9 kA/m; a rod of HyMu-80 of 1 mm x 95 mm is 0.6491 g.
    found = mass_g(np.log([[0.3, 3.0, 3.0]]))[0]
    np.testing.assert_allclose(found, 1e3 * 0.3 / 954.93e3 * 7500.0 + 6 * 0.6491, rtol=1e-4)
