"""Grids land where they are told to; the method has order four; both loops are the same loop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.integrators import BLOCK, StepGrid, integrate, integrate_blocks, rk4_step, rk4_step_for
from jaxsat.math import quaternion

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


@pytest.mark.parametrize(
    ("times", "start"), [([1.0, 3.0, 2.0], 0.0), ([-1.0, 1.0], 0.0), ([2.0, 3.0], 2.5), ([np.nan], 0.0)]
)
def test_refuses_times_that_turn_round(times, start):
    with pytest.raises(ValueError, match="times must run in one direction"):
        StepGrid.through(np.array(times), start=start, max_step=1.0)


# y' = cos(t) y with y(0) = 1 has y = exp(sin t); cos(t) is the tabulated environment.
def growth(y, cosine):
    return cosine * y


def step(y, h, *points):
    return rk4_step(growth, y, h, *points)


def solve(steps, duration=2.0):
    grid = StepGrid.through(np.array([duration]), start=0.0, max_step=duration / steps)
    states = forward(jnp.asarray(np.cos(grid.node_times)), jnp.asarray(grid.step), jnp.ones(()))
    return float(states[grid.sample_index[0]])


@jax.jit
def forward(cosines, lengths, initial):
    return integrate(step, initial, cosines, lengths)


@jax.jit
def in_blocks(cosines, lengths, initial, blocks):
    return integrate_blocks(step, initial, cosines, lengths, blocks)


def test_order_four_by_halving():
    error = np.array([abs(solve(n) - np.exp(np.sin(2.0))) for n in (12, 24, 48)])
    np.testing.assert_allclose(np.log2(error[:-1] / error[1:]), 4.0, atol=0.2)
    # Far from rounding: the slope is the method's.
    assert error[-1] > 1e3 * EPS


def test_one_step_is_the_textbook_one():
    h, y, table = 0.3, 1.7, np.cos([0.5, 0.65, 0.8])
    k1 = table[0] * y
    k2 = table[1] * (y + h / 2 * k1)
    k3 = table[1] * (y + h / 2 * k2)
    k4 = table[2] * (y + h * k3)
    found = rk4_step(growth, jnp.asarray(y), jnp.asarray(h), *jnp.asarray(table))
    assert float(found) == pytest.approx(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), rel=4 * EPS)
    assert float(rk4_step(growth, jnp.asarray(y), jnp.zeros(()), *jnp.asarray(table))) == y


def test_backward_undoes_forward():
    there = StepGrid.through(np.array([3.0]), start=0.0, max_step=0.05)
    back = StepGrid.through(np.array([0.0]), start=3.0, max_step=0.05)
    end = forward(jnp.asarray(np.cos(there.node_times)), jnp.asarray(there.step), jnp.ones(()))[there.sample_index[0]]
    start = forward(jnp.asarray(np.cos(back.node_times)), jnp.asarray(back.step), end)[back.sample_index[0]]
    # The error of one way is 9e-9 at this step, and most of it is undone too.
    assert float(start) == pytest.approx(1.0, abs=9e-9)


GRID = StepGrid.through(np.array([2.0, 2.9]), start=0.0, max_step=0.1, pad_steps=32)
COSINES, LENGTHS = jnp.asarray(np.cos(GRID.node_times)), jnp.asarray(GRID.step)


def test_blocks_do_the_same_steps_to_the_last_bit():
    whole = np.asarray(forward(COSINES, LENGTHS, jnp.ones(())))
    assert whole.shape == (33,)
    for blocks in range(9):
        found = np.asarray(in_blocks(COSINES, LENGTHS, jnp.ones(()), jnp.asarray(blocks)))
        done = BLOCK * blocks + 1
        np.testing.assert_array_equal(found[:done], whole[:done])
        np.testing.assert_array_equal(found[done:], 1.0)
    # Steps of length zero keep the state.
    np.testing.assert_array_equal(whole[GRID.sample_index[-1] :], whole[GRID.sample_index[-1]])


def test_derivatives_of_both_loops():
    # y is linear in its start, and d y(T) / d(log growth at all times) = y(T) sin(T).
    y0, t = 1.3, 2.9
    last = GRID.sample_index[-1]

    def scan(y, scale):
        return integrate(step, y, scale * COSINES, LENGTHS)[last]

    def blocks(y, scale):
        return integrate_blocks(step, y, scale * COSINES, LENGTHS, jnp.asarray(8))[last]

    arguments = jnp.asarray(y0), jnp.ones(())
    exact = np.exp(np.sin(t)), y0 * np.sin(t) * np.exp(np.sin(t))
    reverse = jax.jit(jax.grad(scan, argnums=(0, 1)))(*arguments)
    ahead = jax.jit(jax.jacfwd(blocks, argnums=(0, 1)))(*arguments)
    # The error of RK4 at h = 0.1.
    np.testing.assert_allclose(reverse, exact, rtol=1e-5)
    np.testing.assert_allclose(ahead, reverse, rtol=1e-13)


def turn_error(rate, duration, tolerance):
    """Attitude error of a turn at a constant rate, at the step that the bound allows."""
    h = rk4_step_for(rate, duration, tolerance)
    grid = StepGrid.through(np.array([duration]), start=0.0, max_step=h, pad_steps=512)
    q = turned(jnp.asarray(grid.step), jnp.asarray(rate))[grid.sample_index[0]]
    # Exact half-angle; the turn is about body x.
    w, x = float(q[0]), float(q[1])
    half = 0.5 * rate * duration
    return 2 * abs(np.arctan2(x * np.cos(half) - w * np.sin(half), w * np.cos(half) + x * np.sin(half)))


@jax.jit
def turned(lengths, rate):
    axis = jnp.asarray([1.0, 0.0, 0.0])

    def spin(q, point):
        return 0.5 * quaternion.times_vector(q, rate * axis)

    def advance(q, h, *points):
        return quaternion.normalize(rk4_step(spin, q, h, *points))

    return integrate(advance, jnp.asarray([1.0, 0, 0, 0]), jnp.zeros(2 * lengths.shape[0] + 1), lengths)


@pytest.mark.parametrize(
    ("rate", "duration", "tolerance"),
    [(0.011, 4500.0, 1e-5), (0.05, 1000.0, 1e-3), (0.05, 1000.0, 1e-6), (1.0, 20.0, 1e-4)],
)
def test_bound_on_the_step_holds_and_is_not_timid(rate, duration, tolerance):
    error = turn_error(rate, duration, tolerance)
    # The bound is the leading term of the error: the rest is a few per cent.
    assert 0.9 * tolerance < error <= tolerance
