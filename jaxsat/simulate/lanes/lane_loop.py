"""Lanes side by side in one loop: every pass tries one step of each, until all stand at their last mark."""

import functools
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PyTree

from jaxsat.dynamics import AttitudeState, RigidBody
from jaxsat.environment import OrbitTable
from jaxsat.environment.cells import Cells
from jaxsat.math.case_scan import stored
from jaxsat.math.one_function import WIDE, whole_or_usual
from jaxsat.math.runge_kutta import Tableau
from jaxsat.math.scalars import elements, over_cases
from jaxsat.math.weighted_sum import weighted_sum
from jaxsat.simulate.lanes.lane import Lane, Mark, Own, Taken, planned, settled, slope, started
from jaxsat.torques.branches import lag_from_nearness

STRETCH = 8192
"""Passes between two looks of the host."""
BRIEF = 1e-9
"""A step that a turn holds so short [s] leads nowhere."""


class Marks(eqx.Module):
    """Times at which steps of every lane end."""

    each: Mark
    """Leaves over the marks."""
    place: Int[Array, " marks"]
    """Where the states at it are kept; the last one is for what nobody asked for."""
    count: Int[Array, ""]
    """How many; what comes after them is padding."""

    def number(self, mark: Int[Array, "*lanes"]) -> Mark:
        """Those that the lanes go to."""
        return jax.tree.map(lambda leaf: leaf[jnp.minimum(mark, leaf.shape[0] - 1)], self.each)


class Course(eqx.Module):
    """What all lanes go through."""

    cells: Cells
    powers: OrbitTable
    """Polynomials of all cells."""
    marks: Marks


class Run(eqx.Module):
    """Where the loop stands."""

    lanes: Lane
    """Leaves with the lanes last."""
    kept: Float[Array, "lanes places parts"]
    """Quaternion, angular velocity, lags and heats at the places."""
    passes: Int[Array, ""]
    """Of the last stretch."""
    steps: Float[Array, "passes 2"] | None
    """Length and travel of each step of the first lane in the last stretch, where they are wanted."""


@eqx.filter_jit
def begin(initial: AttitudeState, own: Own, course: Course, places: int, *, varies: bool, recorded: bool) -> Run:
    """Before the first step. Leaves of `initial` and of `own` have the lanes last; the bodies' where they vary."""
    count, dtype = initial.quaternion.shape[-1], initial.quaternion.dtype
    first = jax.tree.map(lambda leaf: jnp.repeat(leaf[0][..., None], count, axis=-1), course.powers)
    mark = course.marks.number(jnp.zeros(count, jnp.int32))
    lanes = _each(started, (initial, own, mark, course.cells, first), varies=varies, number=course.marks.count)
    rods = lanes.beyond.shape[0]
    kept = jnp.full((count, places + 1, 7 + 2 * rods), jnp.nan, dtype)
    return Run(lanes, kept, jnp.zeros((), jnp.int32), jnp.zeros((STRETCH, 2), dtype) if recorded else None)


def onward(run: Run, own: Own, course: Course, tableau: Tableau, *, varies: bool) -> Run:
    """After another stretch of passes, fewer where all lanes stand at their last mark."""
    return _onward(run, own, course, tableau, varies)


def _stretch(within: Callable, run: Run, own: Own, course: Course, tableau: Tableau, varies: bool) -> Run:
    packed, unpacked = _packed(course.powers)
    cells, marks = course.cells, course.marks

    def one_pass(run):
        lanes = run.lanes
        mark, under_way = marks.number(lanes.mark), lanes.mark < marks.count
        stride = _each(planned, (lanes, own, mark, cells), varies=varies, number=run.passes)
        polynomials = unpacked(packed[stride.cell])
        new, taken = _tried(lanes, own, stride, mark, cells, polynomials, tableau, varies, run.passes)
        lost = ~jnp.isfinite(jnp.sum(jnp.concatenate(jax.tree.leaves(new.moving)), axis=0)) | (new.longest < BRIEF)
        arrived = under_way & taken.arrived & ~lost
        place = jnp.where(arrived, marks.place[jnp.minimum(lanes.mark, marks.count - 1)], run.kept.shape[1] - 1)
        new = eqx.tree_at(lambda lane: lane.mark, new, jnp.where(lost, marks.count, new.mark))
        new = jax.tree.map(lambda a, b: jnp.where(under_way.reshape(*(1,) * (a.ndim - 1), -1), a, b), new, lanes)
        lag = lag_from_nearness(new.moving.nearness, new.beyond, new.rising)
        found = jnp.concatenate([new.moving.quaternion, new.moving.angular_velocity, lag, new.moving.heat]).T
        steps = run.steps
        if steps is not None:
            row = jnp.stack([jnp.where(under_way, taken.length, 0.0)[0], taken.travel[0]])
            steps = jax.lax.dynamic_update_index_in_dim(steps, row, run.passes, 0)
        return Run(new, _put(run.kept, place, found), run.passes + 1, steps)

    def go_on(run):
        return (run.passes < STRETCH) & jnp.any(run.lanes.mark < course.marks.count)

    def loop(run):
        return jax.lax.while_loop(go_on, one_pass, run)

    run = eqx.tree_at(lambda run: run.passes, run, jnp.zeros((), jnp.int32))
    return within(loop)(run)


_onward = whole_or_usual(_stretch, WIDE)


def _put(kept, place, found):
    # XLA has no scatter within one function.
    zero = jnp.zeros((), place.dtype)
    for lane in range(kept.shape[0]):
        kept = jax.lax.dynamic_update_slice(kept, found[lane][None, None], (zero + lane, place[lane], zero))
    return kept


def _tried(lanes, own, stride, mark, cells, polynomials, tableau, varies, passes) -> tuple[Lane, Taken]:
    """One step of the method, and what comes of it; the slope at its end is one stage more."""
    start, structure = jax.tree.flatten(lanes.moving)
    cuts = np.cumsum([leaf.shape[0] for leaf in start])[:-1]
    start = jnp.concatenate(start)
    rows = np.pad(np.concatenate([tableau.matrix[1:], tableau.matrix[-1:]]), ((0, 0), (0, 1)))
    rows, shares = (jnp.asarray(x, start.dtype) for x in (rows, np.array([*tableau.nodes, 1.0])))

    def moving(rows):
        return jax.tree.unflatten(structure, jnp.split(rows, cuts))

    def stage(carry, inputs):
        (place, slopes), (number, row, share) = carry, inputs
        given = (moving(place), share, lanes, own, stride, mark, cells, polynomials)
        found = jnp.concatenate(jax.tree.leaves(_each(slope, given, varies=varies, number=number)))
        slopes = jax.lax.dynamic_update_index_in_dim(slopes, found, number, 0)
        return (start + stride.length[None] * weighted_sum(row, slopes), slopes), None

    blank = jnp.zeros((len(shares), *start.shape), start.dtype)
    (end, slopes), _ = jax.lax.scan(stage, (start, blank), (jnp.arange(len(shares)), rows, shares))
    ends = (moving(slopes[0]), moving(slopes[-1]))
    given = (moving(end), ends, lanes, own, stride, mark, cells, polynomials)
    return _each(settled, given, varies=varies, number=passes)


def _each(
    function: Callable[..., PyTree], given: tuple[PyTree, ...], *, varies: bool, number: Int[Array, ""]
) -> PyTree:
    """`function`, written for one lane, of many: leaves with the lanes last, but for what all have in common."""
    arrays, rest = eqx.partition(given, eqx.is_array)

    def ranks_of(tree):
        common = isinstance(tree, Cells) or (isinstance(tree, RigidBody) and not varies)
        return jax.tree.map(lambda x: x.ndim if common else max(x.ndim - 1, 0), tree)

    ranks = jax.tree.map(ranks_of, arrays, is_leaf=lambda tree: isinstance(tree, Cells | RigidBody))
    like = jax.tree.map(lambda x, rank: jax.ShapeDtypeStruct(x.shape[:rank], x.dtype), arrays, ranks)

    def of_one(*arrays):
        return function(*eqx.combine(arrays, rest))

    given = jax.tree.map(lambda x, rank: elements(x, element_rank=rank), arrays, ranks)
    found = over_cases(of_one, *like)(*given, hold=functools.partial(stored, number))
    lanes = max((x.shape[rank:] for x, rank in zip(*map(jax.tree.leaves, (arrays, ranks)), strict=True)), key=len)

    def together(parts, one):
        flat = [jnp.broadcast_to(jnp.asarray(part, one.dtype), lanes) for part in parts.reshape(-1)]
        return jnp.stack(flat).reshape(*one.shape, *lanes)

    return jax.tree.map(together, found, jax.eval_shape(of_one, *like))


def _packed(powers: OrbitTable):
    """All polynomials as one table with a row a cell, and columns of it, lanes last, as polynomials again."""
    leaves, structure = jax.tree.flatten(powers)
    table = jnp.concatenate([leaf.reshape(leaf.shape[0], -1) for leaf in leaves], axis=1)
    cuts = np.cumsum([np.prod(leaf.shape[1:]) for leaf in leaves])[:-1]

    def unpacked(rows):
        pieces = jnp.split(rows.T, cuts)
        shaped = [piece.reshape(*leaf.shape[1:], -1) for piece, leaf in zip(pieces, leaves, strict=True)]
        return jax.tree.unflatten(structure, shaped)

    return table, unpacked
