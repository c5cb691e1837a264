"""Polynomials over cells give the table and its derivatives back; what they cannot follow is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import OrbitTable
from jaxsat.environment.cells import LONGEST, Cells, tabulate_cells

RATE = 2.1e-3


def table(times):
    angle = RATE * np.asarray(times)[:, None]
    c, s = np.cos(angle), np.sin(angle)
    field = 3e-5 * np.concatenate([c, s, c * s], axis=1)
    return OrbitTable(jnp.asarray(7e6 * np.concatenate([c, s, 0.0 * s], axis=1)), jnp.asarray(field))


def derivative(times, order):
    """Of the field, in closed form: cos, sin, and sin(2 x) / 2 turned by a quarter with each order."""
    angle, quarter = RATE * np.asarray(times)[:, None], 0.5 * np.pi * order
    double = 0.5 * 2.0**order * np.sin(2.0 * angle + quarter)
    return 3e-5 * RATE**order * np.concatenate([np.cos(angle + quarter), np.sin(angle + quarter), double], axis=1)


@pytest.mark.parametrize(("start", "end"), [(50.0, 1000.0), (900.0, 130.0)], ids=["forward", "backward"])
def test_table_and_its_derivatives_are_given_back_also_beyond_a_cell(start, end):
    length, count, powers = tabulate_cells(table, start, end, tolerance=1e-10)
    assert abs(length) <= LONGEST and length * count == pytest.approx(end - start, rel=1e-14)
    cells = Cells(jnp.asarray(length), jnp.asarray(count, jnp.int32), None)
    number, since = 1, length * np.array([-0.1, 0.0, 0.4, 1.1])
    times = start + number * length + since
    polynomials = jax.tree.map(lambda leaf: jnp.asarray(leaf[number]), powers)
    found = jax.vmap(lambda t: cells.read(polynomials, t))(jnp.asarray(since))
    second = jax.vmap(lambda t: cells.field_acceleration(polynomials, t))(jnp.asarray(since))
    np.testing.assert_allclose(found.position_eci, table(times).position_eci, atol=7e6 * 1e-10)
    np.testing.assert_allclose(found.b_field_eci, derivative(times, 0), atol=3e-5 * 1e-10)
    # A derivative over a cell is worse by degree squared over its half.
    assert found.b_rate_eci is not None
    np.testing.assert_allclose(found.b_rate_eci, derivative(times, 1), atol=3e-5 * 1e-10 * 2)
    np.testing.assert_allclose(second, derivative(times, 2), atol=3e-5 * 1e-10 * 4)


def test_surroundings_with_an_edge_are_refused_in_words():
    def with_an_edge(times):
        smooth = table(times)
        return OrbitTable(smooth.position_eci, smooth.b_field_eci * jnp.where(times < 500.0, 1.0, 0.9)[:, None])

    with pytest.raises(ValueError, match=r"not smooth: polynomials over \d\.\d s miss it by"):
        tabulate_cells(with_an_edge, 0.0, 1000.0, tolerance=1e-6)
