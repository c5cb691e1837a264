"""Tableaux by the order conditions of rooted trees and SciPy's coefficients; integration in time by closed forms."""

import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate._ivp import dop853_coefficients

from jaxsat.math.runge_kutta import DORMAND_PRINCE_8, RK4, integrate_in_time, runge_kutta_step

EPS = np.finfo(float).eps
METHODS = pytest.mark.parametrize("tableau", [RK4, DORMAND_PRINCE_8], ids=["RK4", "DP8"])


def arrays(tableau):
    """Butcher's A, b and c in full."""
    a, b = np.zeros((tableau.stages, tableau.stages)), np.zeros(tableau.stages)
    for i, row in enumerate(tableau.rows):
        a[i, list(row)] = list(row.values())
    b[list(tableau.weights)] = list(tableau.weights.values())
    return a, b, np.array(tableau.nodes)


def rooted_trees(order):
    """All rooted trees with so many vertices, each the sorted tuple of the trees at its root."""
    if order == 1:
        return {()}
    found = set()
    for first in range(1, order):
        for tree, rest in itertools.product(rooted_trees(first), rooted_trees(order - first)):
            # A tree hung onto the root of another: every tree arises so.
            found.add(tuple(sorted((*rest, tree))))
    return found


def size(tree):
    return 1 + sum(map(size, tree))


def density(tree):
    return size(tree) * math.prod(map(density, tree))


def elementary_weights(tree, a):
    """Derivative weights of the stages: a product over branches (Hairer, Norsett & Wanner 1993, II.2, def. 2.9)."""
    return math.prod((a @ elementary_weights(branch, a) for branch in tree), start=np.ones(len(a)))


@METHODS
def test_order_conditions_of_all_rooted_trees(tableau):
    """b . Phi(t) = 1 / gamma(t) for every tree to the order (theorem II.2.13), not for all of the next."""
    a, b, _ = arrays(tableau)
    trees = [sorted(rooted_trees(n)) for n in range(1, tableau.order + 2)]
    assert [len(each) for each in trees] == [1, 1, 2, 4, 9, 20, 48, 115, 286][: tableau.order + 1]

    def miss(tree):
        return abs(b @ elementary_weights(tree, a) - 1 / density(tree))

    # Rounding grows with the same products of the coefficients' sizes, which reach 43.
    scale = [np.abs(b) @ elementary_weights(t, np.abs(a)) for each in trees[:-1] for t in each]
    misses = [miss(t) for each in trees[:-1] for t in each]
    assert np.all(np.array(misses) < 8 * EPS * np.maximum(scale, 1.0))
    assert max(map(miss, trees[-1])) > 1e-6


@METHODS
def test_nodes_are_row_sums_and_weights_a_quadrature(tableau):
    a, b, c = arrays(tableau)
    np.testing.assert_allclose(a.sum(axis=1), c, rtol=0, atol=2 * EPS * np.abs(a).sum(axis=1).max())
    # Explicit, and no zero is written down.
    assert np.all(np.triu(a) == 0) and np.count_nonzero(a) == sum(map(len, tableau.rows))
    for k in range(tableau.order):
        assert b @ c**k == pytest.approx(1 / (k + 1), rel=0, abs=2 * EPS * np.abs(b).sum())


def test_coefficients_are_those_of_scipy_to_the_last_bit():
    a, b, c = arrays(DORMAND_PRINCE_8)
    np.testing.assert_array_equal(a, dop853_coefficients.A[:12, :12])
    np.testing.assert_array_equal(b, dop853_coefficients.B)
    np.testing.assert_array_equal(c, dop853_coefficients.C[:12])


def test_places_of_the_stages():
    assert RK4.stages == 4 and RK4.inner_nodes == (0.5,) and RK4.node_of_stage == (0, 1, 1, 2)
    inner = DORMAND_PRINCE_8.inner_nodes
    assert DORMAND_PRINCE_8.stages == 12 and len(inner) == 10
    # Stages 5 and 6 stand at 1/3 and 1/4, stages 9 and 10 at 0.65 and 0.6: nodes go back, their order does not.
    assert DORMAND_PRINCE_8.node_of_stage == (0, 1, 2, 3, 5, 7, 4, 6, 9, 8, 10, 11)
    assert all(x < y for x, y in itertools.pairwise((0.0, *inner, 1.0)))


# y' = cos(t) y has y(t) = y(a) exp(sin t - sin a); beside it an oscillator, so that the state is a tree.
def slope(state, t):
    growth, (x, v) = state
    return jnp.cos(t) * growth, (v, -x)


@jax.jit(static_argnums=0)
def run(tableau, state, times, start):
    return integrate_in_time(tableau, slope, state, times, start=start)


def exact(state, times, start):
    (growth, (x, v)), t = state, times - start
    turned = x * np.cos(t) + v * np.sin(t), v * np.cos(t) - x * np.sin(t)
    return growth * np.exp(np.sin(times) - np.sin(start)), turned


STATE = (jnp.asarray(1.3), (jnp.asarray(0.4), jnp.asarray(-1.1)))


def error(tableau, times, start):
    found, expected = run(tableau, STATE, jnp.asarray(times), jnp.asarray(start)), exact(STATE, times, start)
    return max(jax.tree.leaves(jax.tree.map(lambda x, y: np.abs(np.asarray(x) - y).max(), found, expected)))


@pytest.mark.slow
@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["forward", "backward"])
@pytest.mark.parametrize(("tableau", "steps"), [(RK4, 16), (DORMAND_PRINCE_8, 4)], ids=["RK4", "DP8"])
def test_order_by_halving(tableau, steps, direction):
    errors = np.array([error(tableau, 0.3 + direction * np.linspace(0, 3, n + 1)[1:], 0.3) for n in (steps, 2 * steps)])
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), tableau.order, atol=0.5)
    assert errors[1] > 1e3 * EPS


def test_uneven_repeated_and_returning_times():
    times = np.array([0.3, 0.35, 0.35, 0.6, 0.85, 0.55, 0.3])
    found = run(DORMAND_PRINCE_8, STATE, jnp.asarray(times), jnp.asarray(0.3))
    # A step of 0.55 misses by 3.5e-9: 1.5e-11 at 0.3, by the ninth power.
    assert error(DORMAND_PRINCE_8, times, 0.3) < 5e-11
    for leaf, initial in zip(jax.tree.leaves(found), jax.tree.leaves(STATE), strict=True):
        # A step of length zero changes no bit.
        assert leaf[0] == initial and leaf[1] == leaf[2]


def test_start_may_be_a_plain_number_and_single_precision_stays():
    single = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), STATE)
    found = integrate_in_time(DORMAND_PRINCE_8, slope, single, jnp.asarray([0.5, 1.0], jnp.float32), start=0.0)
    assert {leaf.dtype for leaf in jax.tree.leaves(found)} == {jnp.dtype(jnp.float32)}
    expected = jax.tree.leaves(exact(STATE, np.array([0.5, 1.0]), 0.0))
    for leaf, value in zip(jax.tree.leaves(found), expected, strict=True):
        np.testing.assert_allclose(leaf, value, atol=20 * float(np.finfo(np.float32).eps))


@pytest.mark.slow
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev], ids=["forward", "reverse"])
def test_derivatives_by_state_times_and_start(mode):
    initial, times, start = 1.3, np.array([0.3, 0.5, 0.7]), 0.1

    def growth(initial, times, start):
        return integrate_in_time(DORMAND_PRINCE_8, lambda y, t: jnp.cos(t) * y, initial, times, start=start)

    slopes = jax.jit(mode(growth, argnums=(0, 1, 2)))
    by_state, by_times, by_start = slopes(jnp.asarray(initial), jnp.asarray(times), jnp.asarray(start))
    value = initial * np.exp(np.sin(times) - np.sin(start))
    # A step's error, 1e-12 here, changes with its ends by nine times itself over the step.
    np.testing.assert_allclose(by_state, value / initial, atol=1e-11)
    np.testing.assert_allclose(by_start, -np.cos(start) * value, atol=2e-10)
    # Earlier times are but steps on the way: only the requested one moves its state.
    np.testing.assert_allclose(by_times, np.diag(np.cos(times) * value), atol=2e-10)


def test_one_step_of_the_classical_method():
    h, y, points = 0.3, 1.7, np.cos([0.5, 0.65, 0.65, 0.8])
    k1 = points[0] * y
    k2 = points[1] * (y + h / 2 * k1)
    k3 = points[2] * (y + h / 2 * k2)
    k4 = points[3] * (y + h * k3)
    found = runge_kutta_step(
        RK4, lambda y, point: point * y, jnp.asarray(y), jnp.asarray(h), tuple(jnp.asarray(points))
    )
    assert float(found) == pytest.approx(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), rel=4 * EPS)


def test_each_stage_has_a_point():
    with pytest.raises(ValueError):
        runge_kutta_step(RK4, lambda y, point: y, jnp.ones(()), jnp.ones(()), (0.0, 0.0, 0.0))
