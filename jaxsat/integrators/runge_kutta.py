"""Fixed-step Runge-Kutta over tabulated nodes.

A `StepGrid` is laid through the requested times once, on the host; the right-hand side is never asked for the
environment between its nodes, so one table serves every trajectory of a batch.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PyTree

BLOCK = 4
"""Steps that `integrate_blocks` takes between two looks at its traced length; grids are padded to a multiple of it."""


class StepGrid(eqx.Module):
    """Steps that pass through every requested time; padding steps have length 0 and stand at the end."""

    step: Float[Array | np.ndarray, " steps"]
    """Length of each step [s], negative where time runs backward."""
    node_times: Float[Array | np.ndarray, " nodes"]
    """Start, middle, end of each step, shared between neighbours: 2 steps + 1 times [s]."""
    sample_index: Int[Array | np.ndarray, " samples"]
    """State number (0 is the initial one) that stands at each requested time."""

    @staticmethod
    def through(
        times: np.ndarray, *, start: float, max_step: float, pad_samples: int = 1, pad_steps: int = BLOCK
    ) -> "StepGrid":
        """Grid from `start` through monotonic `times` [s] with steps of at most `max_step`.

        The numbers of samples and of steps are padded to multiples of `pad_samples` and `pad_steps`, so that files of
        like shape share one compiled program. Raises ValueError where the times are not monotonic or leave `start`
        on both sides, and where `max_step` is not positive.
        """
        if not max_step > 0:
            raise ValueError(f"StepGrid.through: max_step must be positive, got {max_step}")
        times = np.asarray(times, dtype=float)
        gaps = np.diff(np.concatenate([[start], times]))
        if not (np.all(gaps >= 0) or np.all(gaps <= 0)):
            raise ValueError("StepGrid.through: times must run in one direction away from `start`")
        counts = np.ceil(np.abs(gaps) / max_step * (1 - 1e-12)).astype(int)
        steps = np.repeat(gaps / np.maximum(counts, 1), counts)
        index = np.cumsum(counts)
        steps = np.pad(steps, (0, -len(steps) % pad_steps))
        index = np.pad(index, (0, -len(index) % pad_samples), mode="edge")
        ends = start + np.cumsum(steps)
        # Land on the requested times exactly: rounding must not put a node across a shadow edge from its sample.
        ends[index[: len(times)][counts > 0] - 1] = times[counts > 0]
        edges = np.concatenate([[start], ends])
        nodes = np.empty(2 * len(steps) + 1)
        nodes[0::2], nodes[1::2] = edges, 0.5 * (edges[:-1] + edges[1:])
        return StepGrid(steps, nodes, index)


def rk4_step_for(rate: float, duration: float, tolerance: float) -> float:
    """Longest RK4 step [s] that keeps the attitude error of a turn at `rate` [rad/s] below `tolerance` [rad].

    A quaternion turning at a constant rate w obeys q' = (i w/2) q, of which each step drops (w h/2)^5 / 120; over
    duration/h steps the angle error, twice the quaternion's, adds up to (w/2)^5 h^4 duration / 60.
    """
    return (60.0 * tolerance / (duration * (0.5 * rate) ** 5)) ** 0.25


Derivative = Callable[[PyTree, PyTree], PyTree]
"""f(state, point) -> time derivative, `point` one node of the table."""


def rk4_step(f: Derivative, y: PyTree, h: Float[Array, ""], start: PyTree, middle: PyTree, end: PyTree) -> PyTree:
    """One step of the classical fourth-order method (Kutta 1901) with the environment at its three nodes.

    The four stages run in a loop, so that the right-hand side is traced and compiled once instead of four times.
    """
    points = jax.tree.map(lambda a, b, c: jnp.stack([a, b, b, c]), start, middle, end)
    reach = h * jnp.array([0.0, 0.5, 0.5, 1.0], dtype=h.dtype)
    weight = h * jnp.array([1.0, 2.0, 2.0, 1.0], dtype=h.dtype) / 6.0

    def stage(carry, inputs):
        slope, total = carry
        point, reach, weight = inputs
        slope = f(jax.tree.map(lambda a, k: a + reach * k, y, slope), point)
        return (slope, jax.tree.map(lambda a, k: a + weight * k, total, slope)), None

    zero = jax.tree.map(jnp.zeros_like, y)
    (_, total), _ = jax.lax.scan(stage, (zero, y), (points, reach, weight))
    return total


def _per_step(table: PyTree) -> tuple[PyTree, PyTree, PyTree]:
    return tuple(jax.tree.map(lambda leaf, k=k: leaf[k : leaf.shape[0] - 2 + k : 2], table) for k in (0, 1)) + (
        jax.tree.map(lambda leaf: leaf[2::2], table),
    )


def _with_initial(initial: PyTree, states: PyTree) -> PyTree:
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), initial, states)


def integrate(step: Callable, initial: PyTree, table: PyTree, lengths: Float[Array, " steps"]) -> PyTree:
    """States at every step, the initial one first, by one `lax.scan`.

    `step(state, h, start, middle, end) -> state`; `table` has leaves over the 2 steps + 1 nodes of a `StepGrid`.
    """

    def advance(state, inputs):
        state = step(state, *inputs)
        return state, state

    _, states = jax.lax.scan(advance, initial, (lengths, *_per_step(table)))
    return _with_initial(initial, states)


def integrate_blocks(
    step: Callable, initial: PyTree, table: PyTree, lengths: Float[Array, " steps"], blocks: Int[Array | np.ndarray, ""]
) -> PyTree:
    """Like `integrate`, but stops after `blocks` traced blocks of `BLOCK` steps; later states repeat the initial one.

    One compiled program serves every arc length. Forward-mode derivatives only.
    """
    inputs = (lengths, *_per_step(table))
    blank = jax.tree.map(lambda a: jnp.broadcast_to(a, (lengths.shape[0], *a.shape)), initial)

    def advance(state, inputs):
        state = step(state, *inputs)
        return state, state

    def block(number, carry):
        state, states = carry
        part = jax.tree.map(lambda a: jax.lax.dynamic_slice_in_dim(a, number * BLOCK, BLOCK), inputs)
        state, new = jax.lax.scan(advance, state, part)
        states = jax.tree.map(
            lambda a, b: jax.lax.dynamic_update_slice_in_dim(a, b, number * BLOCK, axis=0), states, new
        )
        return state, states

    _, states = jax.lax.fori_loop(0, blocks, block, (initial, blank))
    return _with_initial(initial, states)
