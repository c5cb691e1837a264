"""Where in a session the search begins: at its longest sunlit stretch, from which the motion is carried to the first.

Arcs that grow across the Earth's shadow leap over half an hour at once, and no start survives that while it is known
over a few minutes alone. Where the session begins with the shorter side of a shadow, the search begins behind it.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.measurements.abstract import PAD_STEPS, RATE_UNIT
from fitting.measurements.observations import Observations
from fitting.parameters.parametrization import Parametrization, build_model
from fitting.starts.multi_start import Starts, carried
from fitting.stored import Stored
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import AbstractMagneticField, KeplerOrbit, tabulate_orbit
from jaxsat.integrators import StepGrid
from jaxsat.math import quaternion
from jaxsat.simulate import simulate_on_grid

LONG_GAP_SAMPLES, LONG_GAP_S = 6.0, 300.0
"""A gap between lit samples parts two stretches where it is longer than so many usual ones and so many seconds."""
TOGETHER = 32
"""Starts carried in one call."""


def longest_stretch(t: np.ndarray, lit: np.ndarray) -> int:
    """Index of the first sample of the stretch with the most lit samples, the earliest of several.

    `t` [time] and `lit` [time] are those of all samples, two of them lit at least.
    """
    place = np.flatnonzero(lit)
    gaps = np.diff(t[place])
    parted = gaps > max(LONG_GAP_SAMPLES * float(np.median(gaps)), LONG_GAP_S)
    stretches = np.split(place, np.flatnonzero(parted) + 1)
    return int(max(stretches, key=len)[0])


def _carry(
    parameters: Parametrization,
    orbit: KeplerOrbit,
    field: AbstractMagneticField,
    greenwich: Float[Array, ""],
    rotation_rate: Float[Array, ""],
    grid: StepGrid,
    x: Float[Array, "starts unknowns"],
    reference: Float[Array, "starts 4"],
) -> tuple[Float[Array, "starts 4"], Float[Array, "starts 3"]]:
    """Attitude and angular velocity [rad/s] of each start at the grid's end."""
    table = tabulate_orbit(orbit, jnp.asarray(grid.node_times), field, greenwich, rotation_rate)

    def one(x, reference):
        spacecraft, *_ = build_model(parameters.values(x[6:]), jnp.asarray(parameters.reference_field))
        start = quaternion.multiply(reference, quaternion.from_rotation_vector(x[:3]))
        motion = simulate_on_grid(spacecraft, AttitudeState(start, x[3:6] * RATE_UNIT), table, grid)
        return motion.quaternion[-1], motion.angular_velocity[-1]

    return jax.vmap(one)(x, reference)


carry = Stored(_carry)


def carried_to(
    starts: Starts, parameters: Parametrization, around: Observations, begin: int, max_step: float
) -> Starts:
    """Starts at sample number `begin` of the observations as starts at the first; steps of `max_step` [s] at most."""
    grid = StepGrid.through(around.t[:1], start=around.t[begin], max_step=max_step, pad_steps=PAD_STEPS)
    numbers = (jnp.asarray(around.greenwich_angle), jnp.asarray(around.earth_rotation_rate))
    return carried(starts, TOGETHER, functools.partial(carry, parameters, around.orbit, around.field, *numbers, grid))
