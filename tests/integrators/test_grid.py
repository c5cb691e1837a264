"""Grids land where they are told to, with the nodes that each method wants."""

import numpy as np
import pytest

from jaxsat.integrators import BLOCK, DORMAND_PRINCE_8, RK4, StepGrid

EPS = np.finfo(float).eps


def edges(grid):
    return np.asarray(grid.node_times)[0::2]


def check(grid, times, start, max_step):
    """Whatever the times: nodes meet the samples exactly, steps are the differences of the edges and short enough."""
    times = np.asarray(times, float)
    nodes, step = np.asarray(grid.node_times), np.asarray(grid.step)
    assert nodes.shape == (2 * len(step) + 1,)
    assert nodes[0] == start
    np.testing.assert_array_equal(edges(grid)[grid.sample_index[: len(times)]], times)
    size = max(np.abs(times).max(), abs(start))
    np.testing.assert_allclose(np.diff(edges(grid)), step, rtol=0, atol=len(step) * EPS * size)
    np.testing.assert_array_equal(nodes[1::2], 0.5 * (nodes[:-1:2] + nodes[2::2]))
    assert np.max(np.abs(step)) <= max_step * (1 + 1e-11)


@pytest.mark.parametrize(
    ("times", "start", "max_step", "counts"),
    [
        # Exact multiples take no step too many, though 0.3 / 0.1 is above 3.
        ([0.1, 0.2, 0.5], 0.0, 0.1, [1, 1, 3]),
        ([64.0, 128.0, 192.0], 0.0, 5.0, [13, 13, 13]),
        # A gap between samples is filled with steps of equal length.
        ([10.0, 17.3, 500.0, 500.1], 3.3, 5.0, [2, 2, 97, 1]),
        # Nothing to do for a sample at the start, nor for one that is given twice.
        ([3.3, 3.3, 7.0, 7.0, 8.0], 3.3, 2.0, [0, 0, 2, 0, 1]),
        ([-1.0, -8.0, -8.5], 1.0, 2.0, [1, 4, 1]),
        ([1e6 + 1 / 3, 1e6 + 2 / 3], 1e6, 0.05, [7, 7]),
    ],
)
def test_steps_land_exactly_on_the_times(times, start, max_step, counts):
    grid = StepGrid.through(np.asarray(times), start=start, max_step=max_step)
    check(grid, times, start, max_step)
    np.testing.assert_array_equal(grid.sample_index, np.cumsum(counts))
    # The fewest steps that the longest one allows.
    gaps = np.abs(np.diff([start, *times]))
    for gap, count in zip(gaps, counts, strict=True):
        assert count == 0 or gap / max_step > (count - 1) * (1 + 1e-12)
    assert np.all(np.asarray(grid.step)[: sum(counts)] * (times[-1] - start) > 0)


def test_padding_stands_at_the_end_and_takes_no_time():
    times = np.array([3.0, 7.0, 11.0])
    grid = StepGrid.through(times, start=0.0, max_step=1.0, pad_samples=5, pad_steps=8)
    check(grid, times, 0.0, 1.0)
    assert grid.step.shape == (16,) and grid.sample_index.shape == (5,)
    np.testing.assert_array_equal(grid.step[11:], 0.0)
    np.testing.assert_array_equal(grid.sample_index, [3, 7, 11, 11, 11])
    np.testing.assert_allclose(grid.node_times[22:], 11.0, rtol=4 * EPS)
    bare = StepGrid.through(times, start=0.0, max_step=1.0, pad_steps=1)
    assert bare.step.shape == (11,)
    assert StepGrid.through(times, start=0.0, max_step=1.0).step.shape[0] % BLOCK == 0


@pytest.mark.parametrize("order", [1.0, -1.0], ids=["forward", "backward"])
def test_steps_end_at_stops_that_are_no_samples(order):
    times, stops = order * np.array([0.0, 4.0, 4.0, 10.0]), order * np.array([-1.0, 2.5, 4.0, 7.25, 10.0, 12.0])
    grid = StepGrid.through(times, start=0.0, max_step=1.0, stops=stops, pad_samples=5)
    check(grid, times, 0.0, 1.0)
    np.testing.assert_array_equal(grid.sample_index, [0, 5, 5, 12, 12])
    assert set(order * np.array([2.5, 7.25])) <= set(edges(grid))
    # Stops that are on no way change nothing.
    bare = StepGrid.through(times, start=0.0, max_step=1.0)
    same = StepGrid.through(times, start=0.0, max_step=1.0, stops=order * np.array([-3.0, 4.0, 11.0]))
    np.testing.assert_array_equal(same.node_times, bare.node_times)
    np.testing.assert_array_equal(same.sample_index, bare.sample_index)


@pytest.mark.parametrize(
    ("times", "start"), [([1.0, 3.0, 2.0], 0.0), ([-1.0, 1.0], 0.0), ([2.0, 3.0], 2.5), ([np.nan], 0.0)]
)
def test_refuses_times_that_turn_round(times, start):
    with pytest.raises(ValueError, match="times must run in one direction"):
        StepGrid.through(np.array(times), start=start, max_step=1.0)


@pytest.mark.parametrize("max_step", [0.0, -1.0, np.nan])
def test_refuses_steps_that_lead_nowhere(max_step):
    with pytest.raises(ValueError, match="max_step must be positive"):
        StepGrid.through(np.array([1.0]), start=0.0, max_step=max_step)


def test_nothing_to_do():
    """All samples at the start: states without steps, or with steps of no length."""
    for pad_steps, pad_samples in ((4, 1), (3, 4)):
        given = np.full(2, 7.0)
        grid = StepGrid.through(given, start=7.0, max_step=1.0, pad_steps=pad_steps, pad_samples=pad_samples)
        assert len(grid.node_times) == 2 * len(grid.step) + 1
        np.testing.assert_array_equal(grid.sample_index, 0)
        np.testing.assert_array_equal(grid.sample_node, 0)
        np.testing.assert_array_equal(grid.step, 0.0)
        np.testing.assert_array_equal(grid.node_times, 7.0)


@pytest.mark.parametrize("tableau", [RK4, DORMAND_PRINCE_8], ids=["RK4", "DP8"])
@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["forward", "backward"])
def test_nodes_stand_where_the_method_wants_them(tableau, direction):
    start, times = 5.0, 5.0 + direction * np.array([0.7, 1.9, 7.0])
    grid = StepGrid.through(times, start=start, max_step=0.5, tableau=tableau, pad_samples=2)
    stride = len(tableau.inner_nodes) + 1
    nodes, steps = np.asarray(grid.node_times), np.asarray(grid.step)
    assert nodes.shape == (stride * len(steps) + 1,)
    begins = nodes[:-1:stride]
    for place, c in zip(tableau.node_of_stage, tableau.nodes, strict=True):
        found = nodes[place : len(nodes) - stride + place : stride]
        np.testing.assert_allclose(found, begins + c * steps, rtol=0, atol=4 * EPS * 12.0)
    assert np.all(direction * np.diff(nodes) >= 0)
    # Where to read a table at the samples, padded ones included.
    np.testing.assert_array_equal(nodes[grid.sample_node], times[[0, 1, 2, 2]])
    assert np.asarray(grid.sample_index).tolist() == [2, 5, 16, 16]
