"""A whole program in one function of machine code, where XLA on a CPU can be told to.

That leans on XLA's inside, for it halves the processor time of a sweep of Earth searches: an attribute of a call that
XLA's compiler for CPUs reads (`xla_cpu_small_call`), set through an experimental module of JAX. Neither is promised to
stay. With another version of JAX than was tried, without that module and on other processors the program is compiled
as usual and gives the same results; where XLA refuses it, `first_that_compiles` falls back too. `JAXSAT_ONE_FUNCTION=0`
in the environment switches it off.
"""

import functools
import os
from collections.abc import Callable, Mapping
from typing import Any, ParamSpec, TypeVar, cast

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.core import eval_jaxpr

P = ParamSpec("P")
R = TypeVar("R")

TRIED = (0, 10)
"""Version of JAX with which this was tried: the attributes are of XLA's inside, not of its interface."""
WIDE: dict[str, Any] = {"xla_cpu_prefer_vector_width": 512, "xla_cpu_use_fusion_emitters": False}
"""The compiler prefers half of a 512-bit register, a third slower; narrower processors do not mind. Of XLA's two
generators of code the older one: the other's arctangents are wrong at that width (jaxlib 0.10.2, from 64 numbers)."""
NO_LIBRARIES: dict[str, Any] = {"xla_cpu_experimental_ynn_fusion_type": ""}
"""What is one function cannot call libraries of kernels, to which XLA would give products of matrices."""
if jax.__version_info__[:2] != TRIED:
    WIDE, NO_LIBRARIES = {}, {}
REFUSED = ("UNIMPLEMENTED", "INTERNAL")
"""Kinds of XLA's errors where it cannot: by itself, by its older generator of code with what stands in libraries, or
as it makes code that is not valid. An error of these kinds that has nothing to do with it comes again."""


def in_one_function(function: Callable[P, R]) -> Callable[P, R]:
    """`function`, for the arguments of a `jax.jit` as they are, compiled for a CPU into a single function.

    By default XLA hands each of the hundreds of small loops of a step to its threads, at every step. Where it cannot be
    told otherwise it is `function` itself. A derivative within must be taken within: what is marked is the whole.
    """
    marked_with = _metadata()
    if marked_with is None:
        return function
    marks = {"xla_cpu_small_call": "true", "inlineable": "false"}

    def marked(*args, **kwargs):
        leaves, structure = jax.tree.flatten((args, kwargs))
        arrays = [leaf for leaf in leaves if eqx.is_array(leaf)]
        result: Any = None

        def of_arrays(*arrays):
            nonlocal result
            given = iter(arrays)
            args, kwargs = jax.tree.unflatten(structure, [next(given) if eqx.is_array(x) else x for x in leaves])
            found, result = jax.tree.flatten(cast(Callable, function)(*args, **kwargs))
            return found

        # With what it closes over, which goes in too.
        program = jax.make_jaxpr(of_arrays)(*arrays)
        packed, unpacked = _packed([*program.consts, *arrays])

        def inner(packed):
            every = unpacked(packed)
            constants, own = every[: len(program.consts)], every[len(program.consts) :]
            found = eval_jaxpr(program.jaxpr, constants, *own)
            return [x for x in found if jnp.size(x)], [vector[-1] for vector in packed]

        rest = iter(marked_with(jax.jit(inner)(packed), **marks)[0])
        like = [x.aval for x in program.jaxpr.outvars]
        found = [next(rest) if x.size else jnp.zeros(x.shape, x.dtype) for x in like]
        return jax.tree.unflatten(result, found)

    return cast(Callable[P, R], marked)


def _packed(arrays: list) -> tuple[list, Callable[[list], list]]:
    """One vector of all elements for each type of numbers, and the function that takes them apart.

    XLA ends the process over an array that comes in and is carried through a loop in which nobody reads it, and over
    one without elements, in or out. Of a longer vector, whose last element is read, each is a part.
    """
    kinds = [jax.random.key_impl(x) if jnp.issubdtype(x.dtype, jax.dtypes.prng_key) else None for x in arrays]
    pairs = zip(arrays, kinds, strict=True)
    arrays = [jnp.asarray(x) if kind is None else jax.random.key_data(x) for x, kind in pairs]
    types = list(dict.fromkeys(x.dtype for x in arrays))
    vectors = [jnp.concatenate([x.reshape(-1) for x in arrays if x.dtype == t] + [jnp.zeros(1, t)]) for t in types]

    def unpacked(vectors):
        begin, found = [0] * len(types), []
        for x, kind in zip(arrays, kinds, strict=True):
            of = types.index(x.dtype)
            part = vectors[of][begin[of] : begin[of] + x.size].reshape(x.shape)
            found.append(part if kind is None else jax.random.wrap_key_data(part, impl=kind))
            begin[of] += x.size
        return found

    return vectors, unpacked


def _metadata() -> Callable | None:
    """What marks a program; None where XLA cannot be told, or nobody has tried."""
    if os.environ.get("JAXSAT_ONE_FUNCTION") == "0":
        return None
    if jax.default_backend() != "cpu" or jax.__version_info__[:2] != TRIED:
        return None
    try:
        from jax.experimental.xla_metadata import set_xla_metadata
    except ImportError:
        return None
    return set_xla_metadata


def whole_or_usual(program: Callable[..., R], options: Mapping[str, Any] | None = None) -> Callable[..., R]:
    """`program(within, ...)`, compiled as `equinox.filter_jit` does, without its first argument.

    What the program calls as `within(part)(*arrays)` is one function of machine code, or `part` itself where XLA
    refuses that. `options` are those of the compiler for CPUs.
    """

    def made(within, options):
        return cast(Any, eqx.filter_jit)(functools.partial(program, within), compiler_options=options)

    @functools.cache
    def chosen():
        # At the first call: to ask for the device begins JAX.
        own = dict(options or {}) if jax.default_backend() == "cpu" else {}
        usual = made(lambda part: part, own)
        return usual if _metadata() is None else first_that_compiles(made(in_one_function, own | NO_LIBRARIES), usual)

    return lambda *args, **kwargs: chosen()(*args, **kwargs)


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """`function` compiled as `equinox.filter_jit` does, for work on one trajectory or a few: five to ten times as fast.

    Give it the whole of what you want, a gradient included: `compiled(jax.grad(loss))`, not `jax.grad(compiled(loss))`.
    On a CPU the program is then one function of machine code (`in_one_function`); where XLA refuses that, and on other
    devices, it is compiled as usual. For thousands of cases `simulate_many` uses all cores, which this does not.
    """

    def whole(within, *args, **kwargs):
        arrays, rest = eqx.partition((args, kwargs), eqx.is_array)
        static: Any = None

        def of_arrays(arrays):
            nonlocal static
            args, kwargs = eqx.combine(arrays, rest)
            found, static = eqx.partition(cast(Callable, function)(*args, **kwargs), eqx.is_array)
            return found

        return eqx.combine(within(of_arrays)(arrays), static)

    return cast(Callable[P, R], functools.wraps(cast(Callable, function))(whole_or_usual(whole)))


def first_that_compiles(first: Callable[P, R], other: Callable[P, R]) -> Callable[P, R]:
    """`first`, or `other` from then on where XLA says that it cannot compile it for this processor."""
    chosen = first

    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        nonlocal chosen
        if chosen is other:
            return other(*args, **kwargs)
        try:
            return first(*args, **kwargs)
        except jax.errors.JaxRuntimeError as error:
            if not any(words in str(error) for words in REFUSED):
                raise
            chosen = other
            return other(*args, **kwargs)

    return run
