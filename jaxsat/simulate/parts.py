"""The attitude of many cases taken apart: each component of the state an array of its own over the cases.

That is what a processor's vector units and a GPU want, and a single case is done faster so too.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsat.dynamics import AttitudeState, RigidBody, derivative
from jaxsat.environment import OrbitTable
from jaxsat.integrators import AdamsGrid, integrate_adams
from jaxsat.math.sample_read import read_samples
from jaxsat.math.scalars import elements, over_cases, regrouped

Parts = tuple[Float[Array | np.ndarray, "*cases"], ...]
"""The components of the state, each over all cases: quaternion, angular velocity, lags of the rods."""


def parts_of(state: AttitudeState) -> Parts:
    """Components of states whose last axes are the cases."""
    return tuple(x for leaf in jax.tree.leaves(state) for x in elements(leaf, element_rank=1))


KEPT = 20_000
"""Steps times cases of which reverse mode keeps the hundred numbers of a slope: it is a third faster so."""
Absent = tuple[tuple[bool, ...], ...]
"""For each array of a body, which of its elements are zero in all cases: terms with them are left out."""


def advance_parts(
    parts: Parts,
    like: AttitudeState,
    body: RigidBody,
    table: OrbitTable,
    grid: AdamsGrid,
    *,
    body_varies: bool = False,
    absent: Absent | None = None,
    count: Int[Array | np.ndarray, ""] | None = None,
    last_only: bool = False,
) -> Float[Array, "samples parts *cases"]:
    """Components of all cases at the grid's samples; with `last_only`, at the end of the last step alone.

    `like` is the state of one case; spacecraft and inverse inertia of `body` have the cases in their last axes if they
    vary; `count` as in `integrate_adams`.
    """
    f, columns = _derivative_of_parts(like, body, table, body_varies, absent)
    if table.position_eci.shape[0] * parts[0].size > KEPT:
        # Reverse mode keeps the state and works the rest out again.
        f = jax.checkpoint(f, prevent_cse=False)
    step, options = jnp.asarray(grid.step), {"count": count, "keep_all": not last_only}
    samples = grid.sample_first, grid.sample_weights
    if jnp.ndim(parts[0]) == 0:
        # A single case as one vector: a loop of numbers is spent on calls of its pieces, and these are fewer.
        states = integrate_adams(
            lambda y, point: jnp.stack(f(tuple(y), tuple(point))),
            jnp.stack(parts),
            jnp.stack(columns, 1),
            step,
            **options,
        )
        return states[None] if last_only else read_samples(states, *samples)
    states = integrate_adams(f, parts, columns, step, **options)
    if last_only:
        return jnp.stack(states)[None]
    return jnp.stack([read_samples(part, *samples) for part in states], axis=1)


def _derivative_of_parts(like, body, table, body_varies, absent):
    """The time derivative as `f(parts, point)`, and the table as the columns of which it wants the points."""
    own, constant = eqx.partition(body, eqx.is_array)
    ranks = jax.tree.map(jnp.ndim, own)
    if body_varies:
        ranks = eqx.tree_at(varying, ranks, jax.tree.map(lambda rank: rank - 1, varying(ranks)))
    one_body = jax.tree.map(lambda x, rank: jax.ShapeDtypeStruct(x.shape[:rank], x.dtype), own, ranks)
    one_point = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[1:], x.dtype), table)
    replayed = over_cases(
        lambda state, point, own: derivative(state, point, eqx.combine(own, constant)), like, one_point, one_body
    )
    body_elements = jax.tree.map(lambda x, rank: elements(x, element_rank=rank), own, ranks)
    if absent is not None:
        leaves, structure = jax.tree.flatten(body_elements)
        leaves = [np.where(np.reshape(zero, x.shape), 0.0, x) for x, zero in zip(leaves, absent, strict=True)]
        body_elements = jax.tree.unflatten(structure, leaves)
    in_columns = [elements(jnp.moveaxis(x, 0, -1), element_rank=x.ndim - 1) for x in jax.tree.leaves(table)]
    columns = [column for group in in_columns for column in group.reshape(-1)]

    def f(parts, point):
        slope = replayed(regrouped(parts, like), regrouped(point, one_point), body_elements)
        flat = [x for leaf in jax.tree.leaves(slope) for x in leaf]
        return tuple(jnp.broadcast_to(jnp.asarray(x, y.dtype), y.shape) for x, y in zip(flat, parts, strict=True))

    return f, tuple(columns)


def varying(body: RigidBody) -> tuple:
    return body.spacecraft, body.inverse_inertia
