"""Motions of satellites with hysteresis rods, by steps that end where the fields along the rods turn."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsat.dynamics import AttitudeState, RigidBody
from jaxsat.integrators import StepGrid, Tableau
from jaxsat.simulate.lanes.course import Layout
from jaxsat.simulate.lanes.lane import Own
from jaxsat.simulate.lanes.lane_loop import STRETCH, begin, onward
from jaxsat.torques.abstract import required

LONGEST_SHARE = 0.5
"""Of a cell that a step may span."""
TRAVEL = 1.0
"""Change of a rod's field over its Hc within a step of a grid over which the lag itself is integrated."""


@dataclasses.dataclass(frozen=True)
class Moved:
    """Where lanes came, and by which steps."""

    states: Float[np.ndarray, "cases samples parts"]
    """Quaternion, angular velocity, lag and heat of the rods."""
    steps: Float[np.ndarray, "steps 2"] | None
    """Length [s] and travel of those of the first lane, where they are recorded."""


def move_lanes(
    initial: AttitudeState,
    body: RigidBody,
    layout: Layout,
    *,
    reach: Float[np.ndarray, " cases"],
    max_step: Float[np.ndarray, " cases"],
    tableau: Tableau,
    varies: bool = False,
    recorded: bool = False,
) -> Moved:
    """Motions from `initial`, leaves over the cases, those of `body` too if it `varies`.

    A step is as long as `reach` over the motion's rate, but at most `max_step` [s].
    """
    dtype = initial.quaternion.dtype
    smallest = jnp.linalg.eigvalsh(body.spacecraft.inertia)[..., 0] * jnp.ones(len(reach), dtype)
    longest = np.minimum(max_step, LONGEST_SHARE * abs(float(layout.course.cells.length)))
    body = jax.tree.map(lambda x: jnp.moveaxis(x, 0, -1) if varies and eqx.is_array(x) else x, body)
    own = Own(body, smallest, jnp.asarray(reach, dtype), jnp.asarray(longest, dtype))
    initial = jax.tree.map(lambda x: jnp.moveaxis(x, 0, -1), initial)
    run = begin(initial, own, layout.course, layout.places, varies=varies, recorded=recorded)
    steps, passes = [], STRETCH
    while passes == STRETCH:
        run = onward(run, own, layout.course, tableau, varies=varies)
        passes = int(run.passes)
        if run.steps is not None:
            steps.append(np.asarray(run.steps)[:passes])
    return Moved(np.asarray(run.kept)[:, layout.place], np.concatenate(steps) if recorded else None)


def grid_of(
    steps: Float[np.ndarray, "steps 2"] | None, layout: Layout, times: np.ndarray, start: float, tableau: Tableau
) -> StepGrid:
    """Grid of the steps that were taken through the times, short enough for the lag itself to be integrated."""
    steps = required(steps, "grid_of", "steps", "those that move_lanes has recorded")
    taken = steps[steps[:, 0] != 0.0]
    ends = start + np.cumsum(taken[:, 0])
    # Sums of lengths round: at the marks the ends are known.
    marks = layout.marks[layout.marks != start]
    order = -1.0 if len(marks) and marks[-1] < start else 1.0
    number = np.searchsorted(order * ends, order * marks)
    before = np.abs(ends[np.maximum(number - 1, 0)] - marks) < np.abs(ends[np.minimum(number, len(ends) - 1)] - marks)
    ends[np.minimum(number - before, len(ends) - 1)] = marks
    parts = np.maximum(1, np.ceil(taken[:, 1] / TRAVEL)).astype(int)
    return StepGrid.along(np.concatenate([[start], ends]), parts, times, tableau)
