"""Functions of small vectors and matrices, replayed element by element for many cases at once.

A right-hand side written with vectors of three reads well and runs badly in a batch: `[cases, 3]` arrays are strided,
and stacked and sliced again at every product. `over_cases` traces such a function for one case and replays it on the
elements, each an array over the cases of its own; the compiler then meets nothing but sums and products.
"""

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.extend.core import ClosedJaxpr, Literal
from jaxtyping import PyTree

Elements = np.ndarray
"""Objects, one for each element of an array: JAX arrays over the cases, JAX scalars common to them, or numbers."""

_TABLE = 1000
"""A constant with more elements stays whole: a table that is read by index, in one gather for all cases."""


def elements(array: Any, *, element_rank: int | None = None) -> Elements:
    """The elements of an array; of its axes the first `element_rank` are its own, by default all, the rest cases."""
    shape = array.shape if element_rank is None else array.shape[:element_rank]
    return _filled((array[index] for index in np.ndindex(shape)), shape)


def _filled(objects: Iterable[Any], shape: Sequence[int]) -> Elements:
    # One by one: NumPy would convert a list of arrays, and even a single one into an array without axes.
    flat = np.empty(math.prod(shape), dtype=object)
    for place, each in enumerate(objects):
        flat[place] = each
    return flat.reshape(shape)


def regrouped(flat: tuple, like: PyTree) -> PyTree:
    """A tree of `Elements` with the shapes of `like`, of all its elements in order."""
    leaves, structure = jax.tree.flatten(like)
    sizes = np.cumsum([0, *(math.prod(leaf.shape) for leaf in leaves)])
    found = []
    for leaf, begin, end in zip(leaves, sizes[:-1], sizes[1:], strict=True):
        found.append(_filled(flat[begin:end], leaf.shape))
    return jax.tree.unflatten(structure, found)


def over_cases(function: Callable[..., PyTree], *like: PyTree) -> Callable[..., PyTree]:
    """`function`, traced for arguments `like` of one case, as a function of trees of `Elements` in their place.

    What it returns are trees of `Elements` too. Derivatives flow.
    """
    shapes = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape, leaf.dtype), like)
    closed, result = jax.make_jaxpr(function, return_shape=True)(*shapes)
    structure = jax.tree.structure(result)

    def replayed(*arguments, hold=lax.optimization_barrier):
        return jax.tree.unflatten(structure, _replay(closed, jax.tree.leaves(arguments), hold))

    return replayed


def _replay(closed: ClosedJaxpr, arguments: list[Elements], hold: Callable) -> list[Elements]:
    known: dict[Any, Elements] = dict(zip(closed.jaxpr.constvars, map(_constant, closed.consts), strict=True))
    known.update(zip(closed.jaxpr.invars, arguments, strict=True))

    def read(atom):
        return _constant(atom.val) if isinstance(atom, Literal) else known[atom]

    for equation in closed.jaxpr.eqns:
        name, inputs = equation.primitive.name, [read(atom) for atom in equation.invars]
        if name in ("jit", "pjit"):
            results = _replay(equation.params["jaxpr"], inputs, hold)
        elif name in _REARRANGING:
            results = [_REARRANGING[name](*inputs, **equation.params)]
        elif name == "optimization_barrier":
            results = _barrier(inputs, [atom.aval.dtype for atom in equation.invars], hold)
        elif name in _ELEMENTWISE:
            results = [_elementwise(equation, inputs)]
        else:
            results = _whole(equation, inputs)
        known.update(zip(equation.outvars, results, strict=True))
    return [read(atom) for atom in closed.jaxpr.outvars]


def _constant(value: Any) -> Any:
    if np.size(value) > _TABLE:
        return jnp.asarray(value)
    return (
        np.asarray(value).astype(object)
        if isinstance(value, np.ndarray | np.generic | float | int)
        else elements(value)
    )


def _barrier(inputs: list[Elements], dtypes: list[Any], hold: Callable) -> list[Elements]:
    """All elements behind one barrier; numbers pass as they are."""
    flat = [(jnp.asarray(x, dtype), x) for xs, dtype in zip(inputs, dtypes, strict=True) for x in xs.reshape(-1)]
    stopped = iter(hold([array for array, x in flat if not isinstance(x, float | int)]))
    passed = tuple(x if isinstance(x, float | int) else next(stopped) for _, x in flat)
    return list(regrouped(passed, tuple(inputs)))


_ELEMENTWISE = frozenset(
    "abs acos add and asin atan atan2 ceil clamp convert_element_type copy cos cosh div eq exp expm1 floor ge gt "
    "integer_pow is_finite le log log1p logistic lt max min mul ne neg not or pow rem round rsqrt select_n sign sin "
    "sinh sqrt square stop_gradient sub tan tanh xor".split()
)


def _elementwise(equation: Any, inputs: list[Elements]) -> Elements:
    dtypes = [atom.aval.dtype for atom in equation.invars]
    shape = equation.outvars[0].aval.shape
    spread = [np.broadcast_to(x, shape) for x in inputs]
    chosen = ([x[index] for x in spread] for index in np.ndindex(shape))
    return _filled((_apply(equation, operands, dtypes) for operands in chosen), shape)


def _apply(equation: Any, operands: list[Any], dtypes: list[Any]) -> Any:
    """One operation on numbers and arrays; sums with zero and products with one or zero are not even written down."""
    name = equation.primitive.name
    if name in ("add", "sub", "mul"):
        left, right = operands
        if name == "mul":
            return _times(left, right, lambda: _bound(equation, operands, dtypes))
        if _is(right, 0):
            return left
        if name == "add" and _is(left, 0):
            return right
    return _bound(equation, operands, dtypes)


def _times(left: Any, right: Any, product: Callable[[], Any]) -> Any:
    if _is(left, 0) or _is(right, 0):
        return 0.0
    if _is(left, 1):
        return right
    return left if _is(right, 1) else product()


def _is(x: Any, value: int) -> bool:
    return isinstance(x, float | int) and bool(x == value)


def _bound(equation: Any, operands: list[Any], dtypes: list[Any]) -> Any:
    arrays = [jnp.asarray(x, dtype) for x, dtype in zip(operands, dtypes, strict=True)]
    cases = max((x.shape for x in arrays), key=len)
    arrays = [x if x.shape == cases else lax.broadcast(x, cases) for x in arrays]
    return equation.primitive.bind(*arrays, **equation.params)


def _add(left: Any, right: Any) -> Any:
    if _is(left, 0):
        return right
    return left if _is(right, 0) else left + right


def _dot_general(left: Elements, right: Elements, *, dimension_numbers: Any, **_: Any) -> Elements:
    (left_summed, right_summed), (left_batch, right_batch) = dimension_numbers
    left_free = [k for k in range(left.ndim) if k not in (*left_summed, *left_batch)]
    right_free = [k for k in range(right.ndim) if k not in (*right_summed, *right_batch)]
    rows = [left.shape[k] for k in (*left_batch, *left_free)]
    columns = [right.shape[k] for k in right_free]
    terms = math.prod(left.shape[k] for k in left_summed)
    left = left.transpose(*left_batch, *left_free, *left_summed).reshape(*rows, terms)
    right = right.transpose(*right_batch, *right_free, *right_summed)
    right = right.reshape(*rows[: len(left_batch)], *columns, terms)

    def entry(index):
        pairs = zip(left[index[: len(rows)]], right[index[: len(left_batch)] + index[len(rows) :]], strict=True)
        return functools.reduce(_add, (_times(x, y, lambda x=x, y=y: x * y) for x, y in pairs), 0.0)

    return _filled(map(entry, np.ndindex(*rows, *columns)), (*rows, *columns))


def _reduce_sum(x: Elements, *, axes: tuple[int, ...], **_: Any) -> Elements:
    kept = [k for k in range(x.ndim) if k not in axes]
    shape = [x.shape[k] for k in kept]
    rows = x.transpose(*kept, *axes).reshape(*shape, math.prod(x.shape[k] for k in axes))
    return _filled((functools.reduce(_add, rows[index], 0.0) for index in np.ndindex(*shape)), shape)


def _broadcast_in_dim(x: Elements, *_: Any, shape: tuple[int, ...], broadcast_dimensions: Any, **__: Any) -> Elements:
    places = [1] * len(shape)
    for axis, place in enumerate(broadcast_dimensions):
        places[place] = x.shape[axis]
    return np.broadcast_to(x.reshape(places), shape)


def _slice(x: Elements, *, start_indices: Any, limit_indices: Any, strides: Any) -> Elements:
    return x[tuple(map(slice, start_indices, limit_indices, strides or (1,) * x.ndim))]


_REARRANGING: dict[str, Callable[..., Elements]] = {
    "broadcast_in_dim": _broadcast_in_dim,
    "concatenate": lambda *xs, dimension: np.concatenate(xs, axis=dimension),
    "dot_general": _dot_general,
    "reduce_sum": _reduce_sum,
    "reshape": lambda x, *, new_sizes, **_: x.reshape(new_sizes),
    "rev": lambda x, *, dimensions: np.flip(x, dimensions),
    "slice": _slice,
    "squeeze": lambda x, *, dimensions: x.reshape([n for k, n in enumerate(x.shape) if k not in dimensions]),
    "stack": lambda *xs, axis: np.stack(xs, axis=axis),
    "transpose": lambda x, *, permutation: x.transpose(permutation),
}


def _whole(equation: Any, inputs: list[Any]) -> list[Elements]:
    """Any other operation, on arrays put together for it and taken apart again."""
    arrays = [_together(x, atom.aval.dtype) for x, atom in zip(inputs, equation.invars, strict=True)]
    one = _alone(equation)
    extra = [x.ndim - atom.aval.ndim for x, atom in zip(arrays, equation.invars, strict=True)]
    for level in range(max(extra, default=0)):
        one = jax.vmap(one, in_axes=[-1 if more > level else None for more in extra], out_axes=-1)
    results = one(*arrays)
    return [elements(x, element_rank=atom.aval.ndim) for x, atom in zip(results, equation.outvars, strict=True)]


def _alone(equation: Any) -> Callable[..., tuple]:
    """The equation as a function of its operands; its own rules of derivatives stay with it."""

    def one(*operands):
        bound = equation.primitive.get_bind_params(equation.params)
        # Older versions of JAX return functions to put before the operands, newer ones parameters alone.
        functions, parameters = bound if isinstance(bound, tuple) else ((), bound)
        found = equation.primitive.bind(*functions, *operands, **parameters)
        return tuple(found) if equation.primitive.multiple_results else (found,)

    return one


def _together(x: Elements | jax.Array, dtype: Any) -> jax.Array:
    if isinstance(x, jax.Array):
        return x
    flat = [jnp.asarray(element, dtype) for element in x.reshape(-1)]
    cases = max((element.shape for element in flat), key=len, default=())
    flat = [element if element.shape == cases else lax.broadcast(element, cases) for element in flat]
    stacked = jnp.stack(flat) if flat else jnp.zeros((0,), dtype)
    return stacked.reshape(x.shape + cases)
