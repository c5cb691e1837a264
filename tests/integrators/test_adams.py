"""Adams' method: published weights, exact polynomials, order by halving, its grid, and derivatives by closed forms."""

import math
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.polynomial import Legendre

from jaxsat.integrators import AdamsGrid, integrate_adams
from jaxsat.integrators.adams import ORDER, START_NODES, adams_weights

EPS = np.finfo(float).eps
# Sum of the sizes of the predictor's weights: what multiplies the rounding of slopes.
WEIGHTS = np.abs(adams_weights(ORDER)[0]).sum()


# Hairer, Norsett & Wanner 1993, III.1, eqs. 1.5 and 1.8; orders 5 and 6 as in Abramowitz & Stegun 1964, 25.5.
BASHFORTH = {
    1: ([1], 1),
    2: ([3, -1], 2),
    3: ([23, -16, 5], 12),
    4: ([55, -59, 37, -9], 24),
    5: ([1901, -2774, 2616, -1274, 251], 720),
    6: ([4277, -7923, 9982, -7298, 2877, -475], 1440),
}
MOULTON = {
    1: ([1], 1),
    2: ([1, 1], 2),
    3: ([5, 8, -1], 12),
    4: ([9, 19, -5, 1], 24),
    5: ([251, 646, -264, 106, -19], 720),
    6: ([475, 1427, -798, 482, -173, 27], 1440),
}


@pytest.mark.parametrize("order", BASHFORTH)
def test_published_weights(order):
    for found, (numerators, denominator) in zip(adams_weights(order), (BASHFORTH[order], MOULTON[order]), strict=True):
        np.testing.assert_allclose(found, np.array(numerators) / denominator, rtol=EPS)


def by_differences(order, corrector):
    """Weights from the coefficients of backward differences and their recurrence (the same, eqs. 1.7 and 1.12)."""
    gamma = []
    for m in range(order):
        left_over = Fraction(0 if corrector and m else 1)
        gamma.append(left_over - sum((g / (m - j + 1) for j, g in enumerate(gamma)), Fraction(0)))
    terms = range(order)
    return [float(sum((-1) ** j * math.comb(m, j) * gamma[m] for m in terms)) for j in terms]


@pytest.mark.parametrize("order", [3, 8, 10, ORDER])
def test_weights_of_any_order(order):
    predictor, corrector = adams_weights(order)
    np.testing.assert_array_equal(predictor, by_differences(order, corrector=False))
    np.testing.assert_array_equal(corrector, by_differences(order, corrector=True))


def test_largest_weights_of_order_ten():
    """As tabulated for predictors of order ten: 538363838 / 7257600 on the slope four steps before the newest."""
    predictor, _ = adams_weights(10)
    assert predictor[4] == pytest.approx(538363838 / 7257600, rel=EPS)
    assert predictor[9] == pytest.approx(-2082753 / 7257600, rel=EPS)
    # Kept: what every trace asks for.
    assert adams_weights(10) is adams_weights(10)


def test_slopes_that_are_polynomials_are_integrated_exactly():
    """Slopes to degree 11 once the method runs alone, to degree 7 from the start; one degree more is not."""

    @jax.jit
    def run(slopes, step):
        return integrate_adams(lambda y, slope: slope, jnp.zeros(()), slopes, step)

    def misses(degree):
        grid = AdamsGrid.through(np.array([1.0]), start=0.0, max_step=1 / 30)
        legendre = Legendre.basis(degree, domain=[0, 1])
        slopes = legendre.deriv()(grid.node_times)
        states = np.asarray(run(jnp.asarray(slopes), jnp.asarray(grid.step)))
        return np.abs(np.diff(states) - np.diff(legendre(np.linspace(0, 1, 31)))), np.abs(slopes).max()

    for degree in (4, 8, ORDER):
        increments, size = misses(degree)
        # Weights of both signs on slopes that are rounded, times a step of 1/30; the polynomials reach 1.
        rounding = EPS * (1 + WEIGHTS / 30 * size)
        assert increments[ORDER - 1 :].max() < rounding
        if degree <= 8:
            assert increments.max() < rounding
    assert misses(ORDER + 1)[0][ORDER - 1 :].max() > 1e-8


def growth(y, cosine):
    return cosine * y


# y' = cos(t) y has y = y(a) exp(sin t - sin a); cos t is the table. Beside it an oscillator: the state is a tree.
def slope(state, cosine):
    y, turn = state
    return growth(y, cosine), (turn[1], -turn[0])


def exact(state, times, start=0.0):
    (y, (x, v)), t = state, times - start
    turned = x * np.cos(t) + v * np.sin(t), v * np.cos(t) - x * np.sin(t)
    return y * np.exp(np.sin(times) - np.sin(start)), turned


STATE = (np.asarray(1.3), (np.asarray(0.4), np.asarray(-1.1)))


@jax.jit(static_argnames="keep_all")
def run(state, cosines, step, count=None, keep_all=True):
    return integrate_adams(slope, state, cosines, step, count=count, keep_all=keep_all)


def laid(times, max_step, start=0.0):
    grid = AdamsGrid.through(np.asarray(times, float), start=start, max_step=max_step)
    return grid, jnp.asarray(np.cos(grid.node_times)), jnp.asarray(grid.step)


def errors(states, times, start=0.0):
    """The largest error of each component."""
    differences = jax.tree.map(lambda x, y: np.abs(np.asarray(x) - y).max(), states, exact(STATE, times, start))
    return np.array(jax.tree.leaves(differences))


@pytest.mark.slow
@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["forward", "backward"])
def test_order_by_halving(direction):
    start, duration, found = 0.2, 3.0 * direction, []
    for steps in (24, 48):
        grid, cosines, step = laid([start + duration], 3.0 / steps, start)
        assert grid.steps == steps and float(step) == pytest.approx(duration / steps, rel=EPS)
        times = start + duration / steps * np.arange(steps + 1)
        states = run(STATE, cosines, step)
        assert states[0].shape == (steps + 1,) and states[0][0] == STATE[0]
        found.append(errors(states, times, start)[0])
    # What remains of the higher orders at these steps adds or takes.
    assert ORDER - 1 < np.log2(found[0] / found[1]) < ORDER + 1
    assert 1e3 * EPS < found[1] < 2e-11


def weights_at(grid, steps):
    """The interpolation of all samples as one matrix over the states."""
    matrix = np.zeros((len(grid.sample_first), steps + 1))
    for row, first, weights in zip(matrix, grid.sample_first, grid.sample_weights, strict=True):
        row[first : first + len(weights)] = weights
    return matrix


@pytest.mark.parametrize(
    ("times", "start", "max_step"),
    [
        ([0.1, 7.3, 7.3, 20.0, 20.1], 0.0, 0.5),
        ([1e6 + 1 / 3, 1e6 + 29.0], 1e6, 1.0),
        ([2.9, -4.0, -17.77], 3.0, 0.4),
        ([5.0, 5.0, 5.001], 5.0, 10.0),
    ],
    ids=["uneven", "late", "backward", "short"],
)
def test_grid_through_any_times(times, start, max_step):
    times = np.array(times)
    grid = AdamsGrid.through(times, start=start, max_step=max_step)
    steps, step, span = grid.steps, float(grid.step), times[-1] - start
    assert abs(step) <= max_step * (1 + 1e-11) and steps >= 2 * ORDER
    assert steps * step == pytest.approx(span, rel=1e-14)
    # The fewest steps that the longest one and the start allow.
    assert steps == 2 * ORDER or abs(span) / (steps - 1) > max_step
    stride = START_NODES // (ORDER - 1)
    ends = np.concatenate([grid.node_times[:START_NODES:stride], grid.node_times[START_NODES:]])
    np.testing.assert_allclose(ends, start + step * np.arange(steps + 1), rtol=4 * EPS)
    inner = (grid.node_times[1:stride] - start) / step
    assert np.all((inner > 0) & (inner < 1)) and np.all(np.diff(inner) > 0)

    weights, place = weights_at(grid, steps), (times - start) / step
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-13)
    middle = steps / 2
    for degree in range(10):
        # Through ten states: exact to degree nine. Scaled to one at the ends.
        states = ((np.arange(steps + 1) - middle) / middle) ** degree
        np.testing.assert_allclose(weights @ states, ((place - middle) / middle) ** degree, atol=1e-12)
    # The ten states around a time, as far as there are any on both sides.
    reach = place - np.asarray(grid.sample_first)
    inside = (place > 5) & (place < steps - 5)
    assert np.all((reach[inside] >= 4) & (reach[inside] <= 6))


@pytest.mark.parametrize("start", [0.0, 10.0, 35.0], ids=["next", "first", "backward"])
def test_equally_spaced_times_are_states_themselves(start):
    """Whether the first one stands at the start or one spacing later; 0.7 does not divide the spacing."""
    times = start + np.sign(20.0 - start) * 2.5 * np.arange(0 if start == 10.0 else 1, 11)
    grid = AdamsGrid.through(times, start=start, max_step=0.7)
    assert grid.steps == 40 and abs(float(grid.step)) == 0.625
    weights = weights_at(grid, 40)
    np.testing.assert_array_equal(np.sort(weights, axis=1)[:, :-1], 0.0)
    np.testing.assert_array_equal(np.argmax(weights, axis=1), np.round((times - start) / float(grid.step)))
    np.testing.assert_array_equal(weights.max(axis=1), 1.0)


@pytest.mark.parametrize(
    ("times", "max_step", "message"),
    [
        ([1.0, 3.0, 2.0], 0.1, "times must run in one direction"),
        ([-1.0, 1.0], 0.1, "times must run in one direction"),
        ([1.0, np.nan], 0.1, "times must run in one direction"),
        ([0.0, 0.0], 0.1, "max_step and span must not be zero"),
        ([1.0], 0.0, "max_step and span must not be zero"),
        ([1.0], -1.0, "max_step and span must not be zero"),
        ([1.0], np.nan, "max_step and span must not be zero"),
    ],
)
def test_refuses_what_it_cannot_lay(times, max_step, message):
    with pytest.raises(ValueError, match=f"AdamsGrid.through: {message}"):
        AdamsGrid.through(np.array(times), start=0.0, max_step=max_step)


GRID, COSINES, STEP = laid([0.31, 1.7, 2.9], 0.05)
TIMES = np.linspace(0, 2.9, 59)
WHOLE = jax.tree.map(np.asarray, run(STATE, COSINES, STEP))


def test_requested_times_between_the_steps():
    assert GRID.steps == 58
    weights = weights_at(GRID, 58)
    # Interpolation by ninth degree in steps of 0.05 misses less than the motion itself: h^10 / 10 of a derivative.
    found = jax.tree.map(lambda states: weights @ states, WHOLE)
    assert errors(found, np.array([0.31, 1.7, 2.9])).max() < 2 * errors(WHOLE, TIMES).max() < 1e-10


def test_last_state_alone():
    last = run(STATE, COSINES, STEP, keep_all=False)
    for alone, states in zip(jax.tree.leaves(last), jax.tree.leaves(WHOLE), strict=True):
        # Two programs: the compiler may fuse products and sums otherwise.
        np.testing.assert_allclose(alone, states[-1], rtol=32 * EPS)


@pytest.mark.slow
@pytest.mark.parametrize("count", [ORDER - 1, ORDER, 23, 58])
def test_counted_steps_are_the_same(count):
    """A traced count of steps on a grid padded for more of them."""
    padded = GRID.padded(70)
    assert padded.steps == 70 and GRID.padded(10).steps == 58
    assert np.all(np.asarray(padded.node_times)[-13:] == GRID.node_times[-1])
    cosines = jnp.asarray(np.cos(padded.node_times))
    found = run(STATE, cosines, STEP, jnp.asarray(count))
    last = run(STATE, cosines, STEP, jnp.asarray(count), keep_all=False)
    for states, whole, alone in zip(*map(jax.tree.leaves, (found, WHOLE, last)), strict=True):
        assert states.shape == (71,)
        np.testing.assert_allclose(states[: count + 1], whole[: count + 1], rtol=32 * EPS)
        np.testing.assert_allclose(alone, whole[count], rtol=32 * EPS)
        np.testing.assert_array_equal(states[count + 1 :], 0.0)


# y is linear in its start, and d y(T) / d(log growth at all times) = y(T) sin(T).
@pytest.mark.slow
@pytest.mark.parametrize("way", ["forward", "forward, counted", "reverse"])
def test_derivatives(way):
    count = jnp.asarray(58) if "counted" in way else None

    def end(initial, scale):
        return integrate_adams(growth, initial, scale * COSINES, STEP, count=count, keep_all=False)

    mode = jax.jacrev if way == "reverse" else jax.jacfwd
    by_initial, by_scale = jax.jit(mode(end, argnums=(0, 1)))(jnp.asarray(1.3), jnp.ones(()))
    grown = np.exp(np.sin(2.9))
    # The derivative of the method: its own error at this step is 1e-12.
    np.testing.assert_allclose([by_initial, by_scale], [grown, 1.3 * np.sin(2.9) * grown], atol=2e-11)


def test_batches():
    scales = np.array([1.0, -2.0, 0.5])
    found = jax.jit(jax.vmap(lambda y: integrate_adams(growth, y, COSINES, STEP)))(jnp.asarray(scales * STATE[0]))
    np.testing.assert_allclose(found, scales[:, None] * WHOLE[0], rtol=64 * EPS)


@pytest.mark.slow
def test_cases_in_the_last_axis():
    """Arrays as a state: each case moves by itself."""
    scales = np.array([1.0, -2.0, 0.5])
    found = run(jax.tree.map(lambda x: jnp.asarray(scales * x), STATE), COSINES, STEP)
    for states, whole in zip(jax.tree.leaves(found), jax.tree.leaves(WHOLE), strict=True):
        np.testing.assert_allclose(states, whole[:, None] * scales, atol=64 * EPS)


def test_single_precision_stays_single():
    single = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), (STATE, COSINES, STEP))
    found = run(*single)
    assert {leaf.dtype for leaf in jax.tree.leaves(found)} == {jnp.dtype(jnp.float32)}
    # Each of 60 steps adds the rounding of slopes and weights, times the step, to states up to 1.3 e, of either sign.
    assert errors(found, TIMES).max() < np.sqrt(60) * np.finfo(np.float32).eps * WEIGHTS * 0.05 * 1.3 * np.e
