"""Numbers and arrays at the door of a module."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, ArrayLike, Float


def float_array(x: ArrayLike | Sequence) -> Float[Array, "..."]:
    """`x` as a floating array of the default precision; a converter for fields of modules.

    Plain numbers go through NumPy: converted by JAX, each would compile a program of its own.
    """
    return jnp.asarray(x, float) if isinstance(x, jax.Array) else put(np.asarray(x, dtype=float))


def put(x: np.ndarray | float) -> Array:
    """`x` as an array of JAX's, at once: `jnp.asarray` compiles a program for each shape, of 7 ms."""
    with jax.ensure_compile_time_eval():
        return jax.device_put(x)


def optional_array(x: ArrayLike | Sequence | None) -> Float[Array, "..."] | None:
    """`float_array` of what may be absent."""
    return None if x is None else float_array(x)


def floating(x: ArrayLike | Sequence) -> Float[Array, "..."]:
    """`x` as a floating array that keeps a precision of its own: whole numbers and plain ones get the default one."""
    own = isinstance(x, jax.Array | np.ndarray) and np.issubdtype(x.dtype, np.floating)
    return jnp.asarray(x) if own else float_array(x)


def optional_floating(x: ArrayLike | Sequence | None) -> Float[Array, "..."] | None:
    """`floating` of what may be absent."""
    return None if x is None else floating(x)


def is_known(*values: object) -> bool:
    """Whether none of them is traced, so that what it is can be asked."""
    return not any(isinstance(value, Tracer) for value in values)


def entries_at(array: Float[Array, " n"], index: np.ndarray) -> Float[Array, " chosen"]:
    """Entries of an array by numbers that are known beforehand: a slice, where they follow each other."""
    index = np.asarray(index, int)
    if len(index) and np.array_equal(index, np.arange(index[0], index[0] + len(index))):
        return array[index[0] : index[0] + len(index)]
    return array[index]


def with_entries(array: Float[Array, " n"], index: np.ndarray, new: Float[Array, " chosen"]) -> Float[Array, " n"]:
    """The array with other entries at numbers that are known beforehand.

    By slices or a choice between two arrays: to write into an array, XLA's CPU goes round a loop for each entry, and
    two more loops for its derivative.
    """
    index, count = np.asarray(index, int), array.shape[0]
    if np.array_equal(index, np.arange(count)):
        return new
    if len(index) and np.array_equal(index, np.arange(index[0], index[0] + len(index))):
        return jnp.concatenate([array[: index[0]], new, array[index[0] + len(index) :]])
    place = np.zeros(count, int)
    place[index] = np.arange(len(index))
    return jnp.where(np.isin(np.arange(count), index), new[place], array)
