"""Runs of a study's closed loop: many cases at once in one scan, or one case with its history."""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, Key, PyTree

from jaxsat.math.case_scan import Inner, scan_cases
from jaxsat.math.scalars import elements

Random = Callable[[Key[Array, ""]], Array]
"""The random numbers of one control period, by a key of it."""


@dataclass(frozen=True)
class ClosedLoop:
    """One control period of one case, as a study writes it."""

    period: Callable[..., tuple[PyTree, PyTree]]
    """`period(*fixed, state, random, *given)` returns the state a period on, and what a person would plot of it."""
    like: tuple[PyTree, ...]
    """Shapes of what is `fixed` for one case."""
    random: Random | None = None
    """None where the loop needs no random numbers: `period` then gets None for them."""
    move: Callable[..., PyTree] | None = None
    """`move(*fixed, state, node)` returns the state a step on, for a loop whose motion takes several in a period; those
    of a period come after its `period`."""
    rows: PyTree = None
    """What a period is given beside, leaves [periods ...], common to all cases; None for nothing."""
    nodes: PyTree = None
    """The same of each step, leaves [periods steps ...]."""


def normals(count: int) -> Random:
    """So many unit normal numbers."""
    return lambda key: jax.random.normal(key, (count,))


def random_of(random: Random, key: Key[Array, ""], number: Int[Array, ""]) -> Array:
    """What is random in control period `number` of a case: of its key and the number alone."""
    return random(jax.random.fold_in(key, number))


def run_cases(
    loop: ClosedLoop, fixed: tuple[PyTree, ...], start: PyTree, keys: Key[Array, " cases"], periods: int
) -> PyTree:
    """The state of every case after a number of control periods; leaves with the cases in front, as those of `start`.

    Of `fixed` a leaf may have the cases in front or be common to all.
    """
    random, rows, nodes = loop.random, loop.rows, loop.nodes
    like = () if random is None else (jax.eval_shape(random, jax.ShapeDtypeStruct((), keys.dtype)),)
    of_rows = () if rows is None else (_one(rows, 1),)

    def step(*given):
        own, row = (given[:-1], given[-1:]) if of_rows else (given, ())
        return loop.period(*own, *(() if like else (None,)), *row)[0]

    def drawn(number):
        found = () if rows is None else (_elements_at(rows, (number,)),)
        if random is None:
            return found
        numbers = jax.vmap(functools.partial(random_of, random, number=number))(keys)
        return (elements(numbers.T, element_rank=1), *found)

    inner = None
    if loop.move is not None:
        steps = jax.tree.leaves(nodes)[0].shape[1]
        inner = Inner(loop.move, steps, lambda *place: (_elements_at(nodes, place),), (_one(nodes, 2),))
    given = {"drawn": drawn, "drawn_like": (*like, *of_rows)} if like or of_rows else {}
    return scan_cases(step, fixed, loop.like, start, periods, inner=inner, **given)


def _one(table: PyTree, axes: int) -> PyTree:
    """Shapes of an entry of a table with so many leading axes."""
    return jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape[axes:], leaf.dtype), table)


def _elements_at(table: PyTree, place: tuple[Int[Array, ""], ...]) -> PyTree:
    """An entry of a table that is common to all cases."""
    return jax.tree.map(lambda leaf: elements(leaf[place]), table)


def run_one(
    loop: ClosedLoop,
    fixed: tuple[PyTree, ...],
    start: PyTree,
    key: Key[Array, ""] | None,
    periods: int,
    *,
    number: int | Int[Array, ""] = 0,
    given: tuple[PyTree, ...] = (),
) -> tuple[PyTree, PyTree]:
    """Final state and history [periods ...] of one case, from its own `start`; without a `key` nothing is random.

    Leaves of `fixed` may have cases in front, of which it is that of `number`; those of `given` have the periods.
    """
    own, random, move = case_of(fixed, loop.like, number), loop.random, loop.move

    def advance(state, now):
        period, *given = now
        drawn = None if random is None or key is None else random_of(random, key, period)
        if move is None:
            return loop.period(*own, state, drawn, *given)
        *given, nodes = given
        state, sample = loop.period(*own, state, drawn, *given)

        def on(state, node, move=move):
            return move(*own, state, node), None

        return jax.lax.scan(on, state, nodes)[0], sample

    tables = tuple(table for table in (loop.rows, loop.nodes) if table is not None)
    tables = jax.tree.map(lambda leaf: leaf[:periods], tables)
    return jax.lax.scan(advance, start, (jnp.arange(periods), *given, *tables))


def case_of(cases: PyTree, like: PyTree, number: int | Int[Array, ""]) -> PyTree:
    """One of cases by its number; leaves that are common to all stay as they are. `like` has the shapes of one case."""
    return jax.tree.map(lambda leaf, one: leaf[number] if leaf.ndim > one.ndim else leaf, cases, like)
