"""A program in one function gives what it gives otherwise."""

import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.math.one_function import TRIED, WIDE, compiled, first_that_compiles, in_one_function


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
    assert (in_one_function(turns) is turns) == (jax.__version_info__[:2] != TRIED)
    monkeypatch.setenv("JAXSAT_ONE_FUNCTION", "0")
    assert in_one_function(turns) is turns
    monkeypatch.delenv("JAXSAT_ONE_FUNCTION")
    monkeypatch.setattr("jaxsat.math.one_function.TRIED", (0, 0))
    assert in_one_function(turns) is turns


def test_arrays_that_nobody_reads_or_that_are_empty_do_no_harm():
    """Over either of them XLA ends the process where they go in as they are."""

    def carried(angle, unread, empty):
        def step(carry):
            number, x, unread = carry
            return number + 1, x + angle, unread

        return jax.lax.while_loop(lambda carry: carry[0] < 5, step, (0, angle, unread))[1], empty[:, :1], unread[:0]

    found = jax.jit(in_one_function(carried))(jnp.ones(3), jnp.ones((4, 2)), jnp.zeros((0, 3)))
    np.testing.assert_array_equal(found[0], 6.0)
    assert [part.shape for part in found[1:]] == [(0, 1), (0, 2)]


def test_a_compiled_function_takes_and_gives_what_equinox_does():
    class Turn(eqx.Module):
        angle: jax.Array
        name: str
        seen: np.ndarray

    def doubled(turn: Turn, factor: float, *, many: bool):
        return eqx.tree_at(lambda t: t.angle, turn, factor * turn.angle), many

    turn = Turn(jnp.arange(3.0), "about x", np.arange(2))
    found, many = compiled(doubled)(turn, 2.0, many=True)
    assert found.name == "about x" and many is True
    np.testing.assert_array_equal(found.angle, [0.0, 2.0, 4.0])
    np.testing.assert_array_equal(found.seen, [0, 1])


def test_what_xla_refuses_in_one_function_is_compiled_as_usual():
    matrix = np.array([[2.0, 1.0], [1.0, 3.0]])
    found = compiled(lambda a, b: jnp.sort(jnp.linalg.solve(a, b)))(jnp.asarray(matrix), jnp.array([5.0, 0.0]))
    np.testing.assert_allclose(found, [-1.0, 3.0], rtol=1e-14)


def test_wide_registers_leave_elementary_functions_right():
    x = np.linspace(-0.95, 0.95, 1000)
    for name in ("arctan", "tan", "arcsin", "arccos", "tanh", "exp", "log1p", "sqrt", "cbrt"):
        argument = np.abs(x) if name == "sqrt" else x
        found = jax.jit(getattr(jnp, name), compiler_options=WIDE)(argument)
        np.testing.assert_allclose(found, getattr(np, name)(argument), rtol=1e-13, atol=1e-15, err_msg=name)


def test_without_what_it_leans_on_the_result_is_the_same(monkeypatch):
    inputs = jnp.linspace(0.0, 0.01, 7), (jnp.ones(7), jnp.zeros(7))
    found = jax.jit(in_one_function(turns))(*inputs)
    monkeypatch.setitem(sys.modules, "jax.experimental.xla_metadata", None)
    plain = in_one_function(turns)
    assert plain is turns
    for one, other in zip(found, jax.jit(plain)(*inputs), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-13)


@pytest.mark.parametrize("words", ["UNIMPLEMENTED: Fusion kind not implemented on CPU", "INTERNAL: Invalid LLVM IR"])
def test_what_this_processor_cannot_compile_is_run_otherwise(words):
    tried = []

    def refused(x):
        tried.append(x)
        raise jax.errors.JaxRuntimeError(words)

    run = first_that_compiles(refused, lambda x: x + 1)
    assert [run(1), run(2)] == [2, 3] and tried == [1]


def test_other_failures_are_not_hidden():
    def full(x):
        raise jax.errors.JaxRuntimeError("RESOURCE_EXHAUSTED: out of memory")

    with pytest.raises(jax.errors.JaxRuntimeError, match="out of memory"):
        first_that_compiles(full, lambda x: x)(1)
