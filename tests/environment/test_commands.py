"""Commands between rows: held or linear, on both sides of a row, on the host as in a traced program."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import Commands

COIL = (np.array([0.0, 5.0, 10.0, 30.0]), np.array([0.0, 1.0, 1.0, -2.0]))
WHEEL = (np.array([2.0, 6.0, 10.0]), np.array([1.0, 3.0, 1.0]))
COMMANDS = Commands.of({"coil": COIL, "wheel": WHEEL}, held=("coil",), linear=("wheel",))
TIMES = np.linspace(-3.0, 40.0, 200)


def test_between_rows_they_are_held_or_linear():
    table = COMMANDS(TIMES)
    held = np.select([TIMES >= 30.0, TIMES >= 5.0], [-2.0, 1.0], 0.0)
    np.testing.assert_array_equal(table.values["coil"], held)
    np.testing.assert_array_equal(table.values_before["coil"], held)
    np.testing.assert_allclose(table.values["wheel"], np.interp(TIMES, *WHEEL), atol=1e-15)
    inside = (WHEEL[0][0] < TIMES) & (WHEEL[0][-1] > TIMES)
    np.testing.assert_array_equal(table.rates["wheel"], np.where(inside, np.where(TIMES < 6.0, 0.5, -0.5), 0.0))
    assert all(isinstance(leaf, np.ndarray) for leaf in jax.tree.leaves(table))


@pytest.mark.parametrize("order", [1, -1], ids=["forward", "backward"])
def test_at_a_row_a_step_that_begins_and_one_that_ends_meet_different_sides(order):
    times = np.array([0.0, 5.0, 10.0, 30.0])[::order]
    table = COMMANDS(times)
    before, after = [0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 1.0, -2.0]
    begun, ended = (after, before) if order > 0 else (before[::-1], after[::-1])
    np.testing.assert_array_equal(table.values["coil"], begun)
    np.testing.assert_array_equal(table.values_before["coil"], ended)
    rates = COMMANDS(np.array([2.0, 6.0, 10.0])[::order])
    before, after = [0.0, 0.5, -0.5], [0.5, -0.5, 0.0]
    begun, ended = (after, before) if order > 0 else (before[::-1], after[::-1])
    np.testing.assert_array_equal(rates.rates["wheel"], begun)
    np.testing.assert_array_equal(rates.rates_before["wheel"], ended)
    # Rounding of a node must not put it on the wrong side of its row.
    near = COMMANDS(times + 1e-9 * np.array([1.0, -1.0, 1.0, -1.0]))
    np.testing.assert_array_equal(near.values["coil"], table.values["coil"])


def test_traced_they_are_the_same():
    times = np.concatenate([TIMES, [40.0]])
    traced = jax.jit(lambda commands, t: commands(t))(COMMANDS, jnp.asarray(times))
    for found, expected in zip(jax.tree.leaves(traced), jax.tree.leaves(COMMANDS(times)), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-14)


def test_jumps_are_where_something_changes_at_once():
    np.testing.assert_array_equal(COMMANDS.jumps(), [2.0, 5.0, 6.0, 10.0, 30.0])
    assert len(Commands.of({}).jumps()) == 0


def test_rows_without_a_value_are_left_out():
    times, values = np.arange(4.0), np.array([1.0, np.nan, 3.0, np.nan])
    table = Commands.of({"c": (times, values)}, held=("c",))(np.array([0.5, 1.5, 2.5, 3.5]))
    np.testing.assert_array_equal(table.values["c"], [1.0, 1.0, 3.0, 3.0])


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"a": COIL}, "no column 'c'; there are a"),
        ({"c": (np.zeros(1), np.full(1, np.nan))}, "column 'c' has no values"),
        ({"c": (np.array([1.0, 1.0]), np.zeros(2))}, "times of column 'c' must rise"),
    ],
)
def test_bad_columns_are_named(columns, message):
    with pytest.raises(ValueError, match=message):
        Commands.of(columns, linear=("c",))
