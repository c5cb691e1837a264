"""Starts at one sample carried to the first: the search begins where something is seen, the motion before that."""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.measurements.abstract import PAD_STEPS, RATE_UNIT
from fitting.measurements.assembly import Samples, commands_of
from fitting.measurements.problem import initial_state
from fitting.measurements.sky import Around, nodes_at
from fitting.parameters.free import FreeLeaves, FreeParameters
from fitting.parameters.names import STATE
from fitting.starts.multi_start import Starts, carried
from fitting.stored import Stored
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.math import quaternion
from jaxsat.satellites.model import Model, with_values
from jaxsat.simulate import simulate_on_grid

TOGETHER = 8
"""Starts carried in one call."""


def _carry(
    parameters: FreeLeaves,
    model: Model,
    table: OrbitTable,
    grid: StepGrid,
    x: Float[Array, "starts unknowns"],
    reference: Float[Array, "starts 4"],
) -> tuple[Float[Array, "starts 4"], Float[Array, "starts 3"]]:
    """Attitude and angular velocity [rad/s] of each start at the grid's end."""
    begin = jax.tree.map(lambda leaf: jnp.asarray(leaf)[0], table)

    def one(x, reference):
        craft = with_values(model, parameters.spots, parameters.values(x[len(STATE) :])).spacecraft
        q = quaternion.multiply(reference, quaternion.from_rotation_vector(x[:3]))
        initial = initial_state(craft, q, x[3:6] * RATE_UNIT, begin)
        motion = simulate_on_grid(craft, initial, table, grid)
        return motion.quaternion[-1], motion.angular_velocity[-1]

    return jax.vmap(one)(x, reference)


carry = Stored(_carry)


def carried_back(
    starts: Starts,
    parameters: FreeParameters,
    samples: Samples,
    begin: int,
    model: Model,
    around: Around,
    max_step: float,
) -> Starts:
    """Starts at sample number `begin` as starts at the first; steps of `max_step` [s] at most."""
    commands = commands_of(model, samples)
    stops = None if commands is None else commands.jumps()
    grid = StepGrid.through(samples.t[:1], start=samples.t[begin], max_step=max_step, stops=stops, pad_steps=PAD_STEPS)
    nodes = np.asarray(grid.node_times)
    table = nodes_at(around, nodes, around.sun_eci(samples.epoch, nodes) if around.pushed else None)
    if commands is not None:
        table = replace(table, commands=commands(nodes))
    return carried(starts, TOGETHER, functools.partial(carry, parameters.tree, model, table, grid))
