"""Many cases of a loop at once: its step replayed on arrays over the cases (`over_cases`), in one scan."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from jaxsat.math.scalars import Elements, elements, over_cases, regrouped


@dataclass(frozen=True)
class Inner:
    """Further steps after each step of the scan."""

    step: Callable[..., PyTree]
    """`step(*fixed, state, *drawn)`, of one case."""
    steps: int
    drawn: Callable[[Any, Any], tuple[Elements, ...]]
    """Of the scan's step and the number of the inner one."""
    like: tuple[PyTree, ...]
    """Shapes of what is drawn."""


def scan_cases(
    step: Callable[..., PyTree],
    fixed: tuple[PyTree, ...],
    fixed_like: tuple[PyTree, ...],
    start: PyTree,
    steps: int,
    *,
    drawn: Callable[[Any], tuple[Elements, ...]] | None = None,
    drawn_like: tuple[PyTree, ...] = (),
    inner: Inner | None = None,
) -> PyTree:
    """The state of every case after a number of steps; leaves with the cases in front, as those of `start`.

    `step(*fixed, state, *drawn)` is written for one case. Of `fixed` a leaf may have the cases in front or be common to
    all; `fixed_like` has the shapes of one case. `drawn(number)` gives the elements of what differs from step to step.
    The `inner` steps follow each step.
    """
    like = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape[1:], leaf.dtype), start)
    replayed = over_cases(step, *fixed_like, like, *drawn_like)
    constant = [
        jax.tree.map(lambda leaf, one: elements(_last(leaf, one), element_rank=len(one.shape)), *pair)
        for pair in zip(fixed, fixed_like, strict=True)
    ]
    count = jax.tree.leaves(start)[0].shape[0]
    rows = jax.tree.map(lambda leaf, one: list(_last(leaf, one).reshape(-1, count)), start, like)
    flat = jax.tree.leaves(rows)

    def taken(one, carry, number, extra):
        state = regrouped(tuple(carry), like)
        after = jax.tree.leaves(one(*constant, state, *extra, hold=functools.partial(stored, number)))
        return [
            jnp.broadcast_to(jnp.asarray(x, old.dtype), old.shape)
            for x, old in zip([element for leaf in after for element in leaf.reshape(-1)], carry, strict=True)
        ]

    inner_one = None if inner is None else over_cases(inner.step, *fixed_like, like, *inner.like)

    def advance(carry, number):
        carry = taken(replayed, carry, number, () if drawn is None else drawn(number))
        if inner is not None and inner.steps == 1:
            return taken(inner_one, carry, number, inner.drawn(number, jnp.zeros_like(number))), None
        if inner is not None:

            def on(carry, place, inner=inner):
                return taken(inner_one, carry, place, inner.drawn(number, place)), None

            carry, _ = jax.lax.scan(on, carry, jnp.arange(inner.steps))
        return carry, None

    final, _ = jax.lax.scan(advance, flat, jnp.arange(steps))
    state = regrouped(tuple(final), like)
    return jax.tree.map(
        lambda leaf, one: jnp.stack(list(leaf.reshape(-1)), axis=-1).reshape(count, *one.shape), state, like
    )


def stored(number, arrays):
    """Arrays that are stored and not computed anew for each of their uses, as XLA would on a CPU.

    It takes barriers away, but not what might be otherwise: no step has a negative number.
    """
    return jax.lax.cond(number >= 0, lambda same: same, lambda same: jax.tree.map(jnp.zeros_like, same), arrays)


def _last(leaf, like):
    """The cases of a leaf behind its own axes."""
    return jnp.moveaxis(leaf, 0, -1) if leaf.ndim > len(like.shape) else leaf
