"""Steps over tabulated nodes: order, textbook steps, and both loops as one, with their derivatives and memory."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.integrators import (
    BLOCK,
    DORMAND_PRINCE_8,
    RK4,
    StepGrid,
    Tableau,
    integrate,
    integrate_blocks,
    tableau_step,
)

EPS = np.finfo(float).eps
EULER = Tableau(1, ({},), {0: 1.0}, (0.0,), reach=0.1)
HEUN_3 = Tableau(3, ({}, {0: 1 / 3}, {1: 2 / 3}), {0: 1 / 4, 2: 3 / 4}, (0.0, 1 / 3, 2 / 3), reach=0.3)
METHODS = {"Euler": EULER, "Heun": HEUN_3, "RK4": RK4, "DP8": DORMAND_PRINCE_8}
BOTH = pytest.mark.parametrize("name", ["RK4", "DP8"])


# y' = cos(t) y with y(0) = 1 has y = exp(sin t); cos(t) is the tabulated environment.
def growth(y, cosine):
    return cosine * y


KEPT = np.array([0, 1, 2, 2, 5, 7, 8, 16, 17, 24, 31, 32, 32])
"""States asked of a run by blocks: the first, the last, twice the same, none of some blocks."""


def step_of(name):
    return lambda y, h, points: tableau_step(METHODS[name], growth, y, h, points)


@jax.jit(static_argnums=0)
def forward(name, cosines, lengths, initial):
    return integrate(step_of(name), initial, cosines, lengths)


@jax.jit(static_argnums=0)
def in_blocks(name, cosines, lengths, initial, blocks):
    return integrate_blocks(step_of(name), initial, cosines, lengths, blocks, KEPT)


def solve(name, steps, duration=2.0, start=0.0, initial=1.0):
    grid = StepGrid.through(np.array([duration]), start=start, max_step=2.0 / steps, tableau=METHODS[name])
    states = forward(name, jnp.asarray(np.cos(grid.node_times)), jnp.asarray(grid.step), jnp.asarray(initial))
    return float(states[grid.sample_index[0]])


@pytest.mark.parametrize(("name", "steps"), [("Euler", 256), ("Heun", 48), ("RK4", 24), ("DP8", 4)])
def test_order_by_halving(name, steps):
    error = np.array([abs(solve(name, n) - np.exp(np.sin(2.0))) for n in (steps, 2 * steps)])
    np.testing.assert_allclose(np.log2(error[0] / error[1]), METHODS[name].order, atol=0.3)
    # Far from rounding: the slope is the method's.
    assert error[1] > 1e3 * EPS


def test_one_step_is_the_textbook_one():
    h, y, table = 0.3, 1.7, np.cos([0.5, 0.65, 0.8])
    k1 = table[0] * y
    k2 = table[1] * (y + h / 2 * k1)
    k3 = table[1] * (y + h / 2 * k2)
    k4 = table[2] * (y + h * k3)
    points = tuple(jnp.asarray(table))
    found = tableau_step(RK4, growth, jnp.asarray(y), jnp.asarray(h), points)
    assert float(found) == pytest.approx(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), rel=4 * EPS)
    assert float(tableau_step(RK4, growth, jnp.asarray(y), jnp.zeros(()), points)) == y


def test_right_hand_side_is_traced_once():
    def traces(tableau):
        calls = []
        points = (jnp.ones(()),) * (len(tableau.inner_nodes) + 2)
        jax.make_jaxpr(
            lambda y: tableau_step(tableau, lambda y, p: calls.append(None) or p * y, y, jnp.ones(()), points)
        )(1.0)
        return len(calls)

    assert [traces(METHODS[name]) for name in ("Heun", "RK4", "DP8")] == [1, 1, 1]


@pytest.mark.parametrize(("name", "steps", "one_way"), [("RK4", 40, 1e-7), ("DP8", 8, 1e-10)])
def test_backward_undoes_forward(name, steps, one_way):
    end = solve(name, steps)
    error = abs(end - np.exp(np.sin(2.0)))
    back = solve(name, steps, duration=0.0, start=2.0, initial=end)
    assert 0 < error < one_way
    # Back again the error is of the same size, and most of it is undone.
    assert back == pytest.approx(1.0, abs=error)


GRIDS = {
    name: StepGrid.through(np.array([2.0, 2.9]), start=0.0, max_step=0.1, pad_steps=32, tableau=METHODS[name])
    for name in ("RK4", "DP8")
}
COSINES = {name: jnp.asarray(np.cos(grid.node_times)) for name, grid in GRIDS.items()}
LENGTHS = jnp.asarray(GRIDS["RK4"].step)


@BOTH
def test_blocks_do_the_same_steps_to_the_last_bit(name):
    last = GRIDS[name].sample_index[-1]
    whole = np.asarray(forward(name, COSINES[name], LENGTHS, jnp.ones(())))
    assert whole.shape == (33,)
    for blocks in range(9):
        found = np.asarray(in_blocks(name, COSINES[name], LENGTHS, jnp.ones(()), jnp.asarray(blocks)))
        done = KEPT <= BLOCK * blocks
        np.testing.assert_array_equal(found[done], whole[KEPT][done])
        np.testing.assert_array_equal(found[~done], 1.0)
    # Steps of length zero keep the state.
    np.testing.assert_array_equal(whole[last:], whole[last])


# y is linear in its start, and d y(T) / d(log growth at all times) = y(T) sin(T).
T = 2.9
START = 1.3
EXACT = np.exp(np.sin(T)), START * np.sin(T) * np.exp(np.sin(T))
# What the methods make of steps of 0.1.
ERROR = {"RK4": 1e-5, "DP8": 1e-12}


def scaled(name, y, scale, **options):
    return integrate(step_of(name), y, scale * COSINES[name], LENGTHS, **options)[GRIDS[name].sample_index[-1]]


@pytest.mark.slow
@BOTH
def test_derivatives_of_both_loops(name):
    def blocks(y, scale):
        states = integrate_blocks(step_of(name), y, scale * COSINES[name], LENGTHS, jnp.asarray(8), KEPT)
        return states[-1]

    arguments = jnp.asarray(START), jnp.ones(())
    reverse = jax.jit(jax.grad(lambda *a: scaled(name, *a), argnums=(0, 1)))(*arguments)
    ahead = jax.jit(jax.jacfwd(blocks, argnums=(0, 1)))(*arguments)
    np.testing.assert_allclose(reverse, EXACT, rtol=ERROR[name])
    np.testing.assert_allclose(ahead, reverse, rtol=1e-13)


PLAIN_SLOPES = jax.jit(jax.grad(lambda *a: scaled("RK4", *a), argnums=(0, 1)))


@pytest.mark.parametrize("every", [1, 5, 100])
def test_checkpoints_change_nothing(every):
    """Neither where they divide the steps nor where they do not, nor where they are more than the steps."""
    arguments = jnp.asarray(START), jnp.ones(())
    expected = forward("RK4", COSINES["RK4"], LENGTHS, jnp.ones(()))

    @jax.jit
    def checkpointed(initial, cosines, lengths):
        return integrate(step_of("RK4"), initial, cosines, lengths, checkpoint_every=every)

    found = checkpointed(jnp.ones(()), COSINES["RK4"], LENGTHS)
    assert found.shape == expected.shape
    np.testing.assert_array_equal(found, expected)
    plain = PLAIN_SLOPES(*arguments)
    slopes = jax.jit(jax.grad(lambda *a: scaled("RK4", *a, checkpoint_every=every), argnums=(0, 1)))(*arguments)
    np.testing.assert_allclose(slopes, plain, rtol=32 * EPS)
    np.testing.assert_allclose(slopes, EXACT, rtol=ERROR["RK4"])


@pytest.mark.slow
def test_checkpoints_save_memory():
    """Steps whose evaluations leave much behind: kept for all 2048 of them, or for 32 at a time."""

    def waves(y, point):
        return jnp.sin(y) * jnp.cos(point * y) - jnp.tanh(y) * y

    def temporary(every):
        def end(y, table, lengths):
            def step(y, h, points):
                return tableau_step(RK4, waves, y, h, points)

            return jnp.sum(integrate(step, y, table, lengths, checkpoint_every=every)[-1])

        shapes = jax.ShapeDtypeStruct((50,), float), jax.ShapeDtypeStruct((4097,), float)
        lengths = jax.ShapeDtypeStruct((2048,), float)
        compiled = jax.jit(jax.grad(end)).lower(*shapes, lengths).compile()
        analysis = compiled.memory_analysis()
        assert analysis is not None
        return analysis.temp_size_in_bytes

    states = 2048 * 50 * 8
    plain, checkpointed = temporary(None), temporary(32)
    # Four stages with some four values each are kept beside the states, or not.
    assert plain > 10 * states
    assert checkpointed < 4 * states


@BOTH
@pytest.mark.parametrize("spare", [-1, 1])
def test_table_of_another_grid_is_refused(name, spare):
    table = jnp.ones(COSINES[name].shape[0] + spare)
    with pytest.raises(ValueError, match="do not fit 32 steps: tabulate at grid.node_times"):
        integrate(step_of(name), jnp.ones(()), table, LENGTHS)
    with pytest.raises(ValueError, match="do not fit 32 steps"):
        integrate_blocks(step_of(name), jnp.ones(()), table, LENGTHS, jnp.asarray(8), KEPT)


@pytest.mark.parametrize(("name", "other"), [("RK4", "DP8"), ("DP8", "RK4")])
def test_table_of_another_method_is_refused(name, other):
    with pytest.raises(ValueError):
        integrate(step_of(name), jnp.ones(()), COSINES[other], LENGTHS)


def test_samples_at_the_start_alone():
    grid = StepGrid.through(np.zeros(2), start=0.0, max_step=0.1)
    found = integrate(step_of("RK4"), jnp.asarray(1.7), jnp.cos(jnp.asarray(grid.node_times)), jnp.asarray(grid.step))
    np.testing.assert_array_equal(found[grid.sample_index], 1.7)


@BOTH
def test_single_precision_stays_single(name):
    single = jnp.float32
    table, lengths = COSINES[name].astype(single), LENGTHS.astype(single)
    found = forward(name, table, lengths, jnp.ones((), single))
    assert found.dtype == single
    error = max(ERROR[name], 10 * np.finfo(single).eps)
    np.testing.assert_allclose(found[GRIDS[name].sample_index[-1]], np.exp(np.sin(T)), rtol=error)


def test_trees_and_batches():
    """A growing number beside an oscillator, over a batch of starts."""

    def f(state, cosine):
        y, turn = state
        return cosine * y, jnp.stack([turn[1], -turn[0]])

    def run(y):
        def step(state, h, points):
            return tableau_step(DORMAND_PRINCE_8, f, state, h, points)

        return integrate(step, (y, jnp.stack([y, 0.0 * y])), COSINES["DP8"], LENGTHS)

    starts = np.array([1.0, -2.0, 0.5])
    states, turns = jax.jit(jax.vmap(run))(jnp.asarray(starts))
    last = GRIDS["DP8"].sample_index[-1]
    assert states.shape == (3, 33) and turns.shape == (3, 33, 2)
    np.testing.assert_allclose(states[:, last], starts * np.exp(np.sin(T)), rtol=1e-12)
    np.testing.assert_allclose(turns[:, last], starts[:, None] * [np.cos(T), -np.sin(T)], atol=1e-12)
