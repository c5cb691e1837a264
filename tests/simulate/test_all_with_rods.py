"""Rods beside all else that acts: a coil and a wheel that are commanded, air, and sunlight with a shadow's edge."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import (
    ExponentialAtmosphere,
    Sun,
    Surroundings,
    igrf_field,
    orbit_from_elements_km_deg,
)
from jaxsat.environment.commands import Commands
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate, simulate_on_grid
from jaxsat.spacecraft import HysteresisRods, Spacecraft, box_facets
from jaxsat.torques import Coil, Wheel

pytestmark = pytest.mark.slow

RODS = HysteresisRods(
    np.eye(3)[:2], np.array([3e-7, 2e-7]), np.array([12.0, 9.0]), np.array([0.004, 0.006]), np.array([0.025, 0.025])
)
CRAFT = Spacecraft(
    jnp.diag(jnp.asarray([2e-3, 2.2e-3, 2.5e-3])),
    jnp.asarray([0.02, 0.0, 0.01]),
    hysteresis_rods=RODS,
    facets=box_facets((0.1, 0.1, 0.3), center_of_mass=(0.01, 0.0, 0.02)),
    parts=(
        Coil([0.0, 1.0, 0.0], 0.5, "coil"),
        Wheel([0.0, 0.0, 1.0], 1e-6, "wheel"),
        Coil([1.0, 0.0, 0.0], 0.1, "off"),
    ),
)
ROWS = np.array([-5.0, 47.0, 113.0, 158.0, 400.0])
COMMANDS = Commands.of(
    {
        "coil": (ROWS, np.array([0.0, 0.1, -0.1, 0.05, 0.0])),
        "wheel": (ROWS, np.array([10.0, 10.0, 60.0, -20.0, 0.0])),
        "off": (ROWS, np.zeros(5)),
    },
    held=("coil", "off"),
    linear=("wheel",),
)
ORBIT = orbit_from_elements_km_deg(
    a_km=6778.0, e=0.001, i_deg=51.6, raan_deg=10.0, argp_deg=0.0, mean_anomaly_deg=100.0
)
AROUND = Surroundings(
    ORBIT,
    igrf_field(2020.0, degree=2),
    greenwich_angle_0=0.3,
    field_rate=True,
    atmosphere=ExponentialAtmosphere(),
    sun=Sun(0.2),
    commands=COMMANDS,
)
TIMES = np.array([60.0, 130.0, 200.0])


def test_motion_is_that_of_tiny_steps_and_its_error_is_stated():
    initial = AttitudeState(jnp.asarray([0.5, -0.5, 0.1, 0.7]), jnp.asarray([0.05, -0.08, 0.06]), jnp.zeros(2))
    motion = simulate(CRAFT, initial, AROUND, TIMES, tolerance=1e-6)
    grid = StepGrid.through(TIMES, start=0.0, max_step=0.1, stops=COMMANDS.jumps())
    unit = AttitudeState(initial.quaternion, initial.angular_velocity, initial.rod_lag)
    unit = eqx.tree_at(lambda s: s.quaternion, unit, unit.quaternion / jnp.linalg.norm(unit.quaternion))
    fine = eqx.filter_jit(simulate_on_grid)(CRAFT, unit, AROUND(grid.node_times), grid)
    p, q = (Rotation.from_quat(np.asarray(x.quaternion), scalar_first=True) for x in (motion, fine))
    # Faces that turn into the wind and the light are kinks within steps: of second order the error is of their size.
    assert motion.error is not None and (p.inv() * q).magnitude().max() <= 2.0 * motion.error <= 2e-6
    np.testing.assert_allclose(motion.angular_velocity, fine.angular_velocity, atol=1e-7)
    # The grid that was found leads there too: its steps end at the turns and where commands jump.
    found = motion.grid
    assert isinstance(found, StepGrid) and np.isin(COMMANDS.jumps()[1:3], found.node_times).all()
