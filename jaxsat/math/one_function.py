"""A whole program in one function of machine code, where XLA on a CPU can be told to.

That leans on XLA's inside, for it halves the processor time of a sweep of Earth searches: an attribute of a call that
XLA's compiler for CPUs reads (`xla_cpu_small_call`), set through an experimental module of JAX. Neither is promised to
stay. With another version of JAX than was tried, without that module and on other processors the program is compiled
as usual and gives the same results; where XLA refuses it, `first_that_compiles` falls back too.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import jax

P = ParamSpec("P")
R = TypeVar("R")

TRIED = (0, 10)
"""Version of JAX with which this was tried: the attributes are of XLA's inside, not of its interface."""


REFUSED = ("UNIMPLEMENTED", "Failed to materialize symbols")
"""In XLA's errors where it cannot: by itself, or by its older generator of code with what stands in libraries."""


def in_one_function(function: Callable[P, R]) -> Callable[P, R]:
    """`function`, for the arguments of a `jax.jit` as they are, compiled for a CPU into a single function.

    By default XLA hands each of the hundreds of small loops of a step to its threads, at every step. Where it cannot be
    told otherwise it is `function` itself.
    """
    if jax.default_backend() != "cpu" or jax.__version_info__[:2] != TRIED:
        return function
    try:
        from jax.experimental.xla_metadata import set_xla_metadata
    except ImportError:
        return function
    marks = {"xla_cpu_small_call": "true", "inlineable": "false"}
    inner = jax.jit(function)
    return lambda *args, **kwargs: cast(R, set_xla_metadata(inner(*args, **kwargs), **marks))


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
