"""Where the numbers of a knob stand in a tree of arrays, and the tree with the knobs of each case moved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.sweep.knobs.knob import Knob

Tree = TypeVar("Tree")
Where = Callable[[Any], Any]
"""A leaf of the tree."""


@dataclass(frozen=True)
class Turn:
    """A knob with the leaves that it moves."""

    knob: Knob
    where: tuple[Where, ...]
    """Those that are multiplied by the factor, or get the sum."""
    inverse: tuple[Where, ...] = ()
    """Those that are divided by the factor."""
    about: bool = False
    """Whether only what differs from the nominal leaf is multiplied: the size of an error that is drawn."""
    to_si: float = 1.0
    """From the knob's unit to that of the leaves; counts for sums alone."""
    entry: int | None = None
    """The only number of vectors that is moved; None: all of them."""


def turned(tree: Tree, like: Any, turns: Sequence[Turn], moved: Float[Array | np.ndarray, "cases knobs"]) -> Tree:
    """A tree whose leaves have the cases in front or are common to all, with the knobs of each case moved.

    `like` is the tree of one case with its nominal numbers; column k of `moved` is that of turn k. Differentiable.
    """
    for k, turn in enumerate(turns):
        move, shift = moved[:, k], turn.knob.shift
        change = jnp.exp(move) if shift is None else move * (shift * turn.to_si)
        for where in turn.where:
            nominal = jnp.asarray(where(like))
            own = 1.0 if turn.entry is None else np.eye(nominal.size)[turn.entry][None]
            if shift is not None:
                tree = _changed(tree, where, nominal, lambda leaf, by, own=own: leaf + own * by, change)
            elif turn.about:
                tree = _changed(
                    tree, where, nominal, lambda leaf, by, mid=nominal[None]: mid + by * (leaf - mid), change
                )
            else:
                tree = _changed(tree, where, nominal, lambda leaf, by, own=own: leaf * (1.0 + own * (by - 1.0)), change)
        for where in turn.inverse:
            tree = _changed(tree, where, jnp.asarray(where(like)), lambda leaf, by: leaf / by, change)
    return tree


def _changed(tree, where, nominal, by, change):
    leaf = jnp.asarray(where(tree))
    of_cases = leaf if leaf.ndim > nominal.ndim else jnp.broadcast_to(leaf, (len(change), *leaf.shape))
    return eqx.tree_at(where, tree, by(of_cases, change.reshape(-1, *[1] * nominal.ndim)))


def positive(turns: Sequence[Turn]) -> tuple[Turn, ...]:
    """Those that can be moved: without knobs by factors that are zero, as a gain that the options have switched off."""
    return tuple(turn for turn in turns if turn.knob.shift is not None or turn.knob.value > 0.0)


def largest_moment(inertia: Any) -> float:
    """Of a tensor of inertia, for a knob's value [kg m^2]."""
    return float(np.linalg.eigvalsh(np.asarray(inertia)).max())
