"""A program in one function gives what it gives otherwise."""

import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.math.one_function import TRIED, first_that_compiles, in_one_function


def turns(angle, start):
    """A vector turned a thousand times by an angle."""
    c, s = jnp.cos(angle), jnp.sin(angle)

    def step(v, _):
        x, y = v
        return (c * x - s * y, s * x + c * y), None

    return jax.lax.scan(step, start, length=1000)[0]


def test_the_result_is_that_of_the_closed_form():
    angle = jnp.linspace(0.0, 0.01, 7)
    x, y = jax.jit(in_one_function(turns))(angle, (jnp.ones(7), jnp.zeros(7)))
    np.testing.assert_allclose(x, np.cos(1000.0 * angle), atol=1e-12)
    np.testing.assert_allclose(y, np.sin(1000.0 * angle), atol=1e-12)


def test_only_versions_that_were_tried_are_told(monkeypatch):
    assert len(TRIED) == 2
    monkeypatch.setattr("jaxsat.math.one_function.TRIED", (0, 0))
    assert in_one_function(turns) is turns


def test_without_what_it_leans_on_the_result_is_the_same(monkeypatch):
    inputs = jnp.linspace(0.0, 0.01, 7), (jnp.ones(7), jnp.zeros(7))
    found = jax.jit(in_one_function(turns))(*inputs)
    monkeypatch.setitem(sys.modules, "jax.experimental.xla_metadata", None)
    plain = in_one_function(turns)
    assert plain is turns
    for one, other in zip(found, jax.jit(plain)(*inputs), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-13)


def test_what_this_processor_cannot_compile_is_run_otherwise():
    tried = []

    def refused(x):
        tried.append(x)
        raise jax.errors.JaxRuntimeError("UNIMPLEMENTED: Fusion kind not implemented on CPU")

    run = first_that_compiles(refused, lambda x: x + 1)
    assert [run(1), run(2)] == [2, 3] and tried == [1]


def test_other_failures_are_not_hidden():
    def full(x):
        raise jax.errors.JaxRuntimeError("RESOURCE_EXHAUSTED: out of memory")

    with pytest.raises(jax.errors.JaxRuntimeError, match="out of memory"):
        first_that_compiles(full, lambda x: x)(1)
