"""Fixed-step Runge-Kutta over tabulated nodes.

A `StepGrid` is laid through the requested times once, on the host; the right-hand side is never asked for the
environment between its nodes, so one table serves every trajectory of a batch.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PyTree

from jaxsat.integrators.grid import BLOCK
from jaxsat.math.runge_kutta import Derivative, Tableau
from jaxsat.math.weighted_sum import weighted_sum

Step = Callable[[PyTree, Float[Array, ""], tuple[PyTree, ...]], PyTree]
"""step(state, h, points) -> state, `points` the table's entries at start, inner nodes and end of the step."""


def tableau_step(
    tableau: Tableau, f: Derivative, state: PyTree, h: Float[Array, ""], points: tuple[PyTree, ...]
) -> PyTree:
    """One step of the method with the environment at start, inner nodes and end of the step.

    The stages run in a loop: the right-hand side is traced and compiled once, and what one stage leaves is in memory
    before the next reads it, where the compiler would else compute all stages once more for every array of the state.
    """
    if all(set(row) <= {i - 1} for i, row in enumerate(tableau.rows)):
        return _chained_step(tableau, f, state, h, _stages(tableau, points))
    return staged_step(tableau, f, state, h, points)[0]


def staged_step(
    tableau: Tableau,
    f: Derivative,
    state: PyTree,
    h: Float[Array, ""],
    points: tuple[PyTree, ...],
    *,
    closed: bool = False,
) -> tuple[PyTree, PyTree]:
    """`tableau_step` and the slopes of its stages; with `closed`, of one stage more at the end of the step."""
    stages = _stages(tableau, points)
    # Row i moves from the state to where stage i + 1 looks, the last one to the end of the step.
    rows = tableau.matrix[1:]
    if closed:
        stages = jax.tree.map(lambda a, end: jnp.concatenate([a, end[None]]), stages, points[-1])
        rows = np.pad(np.concatenate([rows, rows[-1:]]), ((0, 0), (0, 1)))
    rows = jnp.asarray(rows, h.dtype) * h

    def stage(carry, inputs):
        place, slopes = carry
        number, row, point = inputs
        slope = f(place, point)
        slopes = jax.tree.map(lambda k, new: jax.lax.dynamic_update_index_in_dim(k, new, number, 0), slopes, slope)
        return (jax.tree.map(lambda y, k: y + weighted_sum(row, k), state, slopes), slopes), None

    count = rows.shape[1]
    blank = jax.tree.map(lambda a: jnp.zeros((count, *a.shape), a.dtype), state)
    (end, slopes), _ = jax.lax.scan(stage, (state, blank), (jnp.arange(count), rows, stages))
    return end, slopes


def _stages(tableau: Tableau, points: tuple[PyTree, ...]) -> PyTree:
    """The points that the stages look at, one after the other."""
    wanted = len(tableau.inner_nodes) + 2
    if len(points) != wanted:
        raise ValueError(f"the table has {len(points)} nodes a step, the method wants {wanted}: lay the grid for it")
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *(points[place] for place in tableau.node_of_stage))


def _chained_step(tableau: Tableau, f: Derivative, state: PyTree, h: Float[Array, ""], stages: PyTree) -> PyTree:
    """The same where each stage needs only the one before it, as in RK4: no slope has to be kept."""
    reach = h * jnp.array([row.get(i - 1, 0.0) for i, row in enumerate(tableau.rows)], dtype=h.dtype)
    weight = h * jnp.array([tableau.weights.get(i, 0.0) for i in range(tableau.stages)], dtype=h.dtype)

    def stage(carry, inputs):
        slope, total = carry
        point, reach, weight = inputs
        slope = f(jax.tree.map(lambda a, k: a + reach * k, state, slope), point)
        return (slope, jax.tree.map(lambda a, k: a + weight * k, total, slope)), None

    zero = jax.tree.map(jnp.zeros_like, state)
    (_, total), _ = jax.lax.scan(stage, (zero, state), (stages, reach, weight))
    return total


def nodes_of_steps(table: PyTree, steps: int) -> tuple[PyTree, ...]:
    """For each node of a step, start to end, the table's entries at it, one for each step."""
    nodes = jax.tree.leaves(table)[0].shape[0]
    stride = (nodes - 1) // max(steps, 1)
    if nodes != stride * steps + 1:
        raise ValueError(f"the table has {nodes} nodes, which do not fit {steps} steps: tabulate at grid.node_times")
    return tuple(
        jax.tree.map(lambda leaf, k=k: leaf[k : stride * (steps - 1) + k + 1 : stride], table)
        for k in range(stride + 1)
    )


def _with_initial(initial: PyTree, states: PyTree) -> PyTree:
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), initial, states)


def integrate(
    step: Step, initial: PyTree, table: PyTree, lengths: Float[Array, " steps"], *, checkpoint_every: int | None = None
) -> PyTree:
    """States at every step, the initial one first, by one `lax.scan`.

    `table` has leaves over the nodes of a `StepGrid`. Reverse-mode derivatives keep what every step computed; with
    `checkpoint_every` they keep only the states and every so many steps are computed once more, so that memory grows
    as steps / checkpoint_every + checkpoint_every (Griewank & Walther 2008, ch. 12).
    """
    steps = lengths.shape[0]
    if steps == 0:
        return jax.tree.map(lambda a: a[None], initial)
    inputs = (lengths, nodes_of_steps(table, steps))

    def advance(state, inputs):
        state = step(state, *inputs)
        return state, state

    if checkpoint_every is None:
        _, states = jax.lax.scan(advance, initial, inputs)
        return _with_initial(initial, states)

    segments = -(-steps // checkpoint_every)

    def in_segments(leaf):
        extra = segments * checkpoint_every - steps
        # Repeated entries with steps of length zero change nothing.
        padded = jnp.concatenate([leaf, jnp.repeat(leaf[-1:], extra, axis=0)])
        return padded.reshape(segments, checkpoint_every, *leaf.shape[1:])

    padded_lengths = jnp.pad(lengths, (0, segments * checkpoint_every - steps)).reshape(segments, checkpoint_every)
    padded_points = jax.tree.map(in_segments, inputs[1])

    @jax.checkpoint
    def segment(state, inputs):
        return jax.lax.scan(advance, state, inputs)

    _, states = jax.lax.scan(segment, initial, (padded_lengths, padded_points))
    return _with_initial(initial, jax.tree.map(lambda a: a.reshape(-1, *a.shape[2:])[:steps], states))


def integrate_blocks(
    step: Step,
    initial: PyTree,
    table: PyTree,
    lengths: Float[Array, " steps"],
    blocks: Int[Array | np.ndarray, ""],
    kept: Int[Array | np.ndarray, " samples"],
) -> PyTree:
    """Like `integrate`, but stops after `blocks` traced blocks of `BLOCK` steps, and keeps the states `kept` alone.

    `kept` are numbers of states in rising order, 0 the initial one; of those beyond the end the initial state stands.
    One compiled program serves every arc length. Forward-mode derivatives only.
    """
    kept = jnp.asarray(kept)
    states = jax.tree.map(lambda a: jnp.broadcast_to(a, (kept.shape[0] + 1, *a.shape)), initial)
    first = jnp.searchsorted(kept, kept)
    if lengths.shape[0] > 0:
        number = jnp.arange(1, lengths.shape[0] + 1)
        place = jnp.searchsorted(kept, number)
        wanted = jnp.take(kept, place, mode="clip") == number
        # One place more for what nobody asks for: to write it there costs less than to ask.
        inputs = (lengths, nodes_of_steps(table, lengths.shape[0]), jnp.where(wanted, place, kept.shape[0]))

        def advance(carry, inputs):
            state, states = carry
            *inputs, place = inputs
            state = step(state, *inputs)
            states = jax.tree.map(lambda a, b: jax.lax.dynamic_update_index_in_dim(a, b, place, 0), states, state)
            return (state, states), None

        def block(number, carry):
            part = jax.tree.map(lambda a: jax.lax.dynamic_slice_in_dim(a, number * BLOCK, BLOCK), inputs)
            return jax.lax.scan(advance, carry, part)[0]

        _, states = jax.lax.fori_loop(0, blocks, block, (initial, states))
    return jax.tree.map(lambda a: a[first], states)
