"""Factors of two known patterns of light against SciPy, at the edges, and their slopes."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import nnls

from fitting.local.shares import bounded_factors, nonnegative_factors


@functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
@functools.partial(jax.value_and_grad, argnums=(0, 1, 2))
def total(first, second, measured):
    a, b = nonnegative_factors(first, second, measured)
    return a + 2.0 * b


def test_bounded_factors_are_the_least_squares_under_the_bound():
    rng = np.random.default_rng(2)
    solve = jax.jit(bounded_factors)
    edges = set()
    for _ in range(300):
        direct = np.maximum(rng.normal(size=6), 0.0) + 1e-3
        albedo = np.maximum(rng.normal(size=6), 0.0)
        limit = rng.uniform(0.2, 1.5)
        measured = rng.uniform(0, 2) * direct + rng.normal() * albedo + 0.3 * rng.normal(size=6)
        found = [float(k) for k in solve(*(jnp.asarray(v) for v in (direct, albedo, measured)), jnp.asarray(limit))]
        # The cone 0 <= albedo <= limit * direct is spanned by its edges (1, 0) and (1, limit) with factors >= 0.
        (low, high), _ = nnls(np.stack([direct, direct + limit * albedo], axis=1), measured)
        np.testing.assert_allclose(found, [low + high, limit * high], atol=1e-9)
        edges.add((low > 0, high > 0))
    assert len(edges) >= 3, "the cases must reach the inside and both edges"


@pytest.mark.parametrize("albedo", [np.zeros(6), np.arange(1.0, 7.0)], ids=["no albedo", "parallel patterns"])
def test_bounded_factors_of_patterns_that_cannot_be_told_apart(albedo):
    direct = np.arange(1.0, 7.0)
    a, b = bounded_factors(jnp.asarray(direct), jnp.asarray(albedo), jnp.asarray(2.0 * direct), jnp.asarray(0.5))
    np.testing.assert_allclose(float(a) * direct + float(b) * albedo, 2.0 * direct, rtol=1e-12)
    assert 0.0 <= float(b) <= 0.5 * float(a) + 1e-12


def test_bounded_factors_in_the_dark_are_finite():
    dark = jnp.zeros(6)
    assert [float(k) for k in bounded_factors(dark, dark, dark, jnp.asarray(1.0))] == [0.0, 0.0]


def test_nonnegative_factors_are_those_of_lawson_and_hanson():
    rng = np.random.default_rng(5)
    solve = jax.jit(nonnegative_factors)
    kinds = set()
    for _ in range(200):
        patterns = np.maximum(rng.normal(size=(6, 2)), 0.0)
        measured = patterns @ rng.normal(size=2) + 0.3 * rng.normal(size=6)
        expected, _ = nnls(patterns, measured)
        found = [float(k) for k in solve(*(jnp.asarray(v) for v in (*patterns.T, measured)))]
        np.testing.assert_allclose(found, expected, atol=1e-10)
        kinds.add(tuple(expected > 0))
    assert len(kinds) == 4


@pytest.mark.parametrize("shares", [(1.0, 0.4), (1.0, -0.5), (-0.3, 0.8)], ids=["inside", "no albedo", "albedo only"])
def test_slopes_of_the_factors_against_differences(shares):
    rng = np.random.default_rng(1)
    first, second = np.maximum(rng.normal(size=(2, 6)), 0.0)
    measured = shares[0] * first + shares[1] * second + 0.01
    along = rng.normal(size=(3, 6))

    def value(h):
        return total(*(v + h * d for v, d in zip((first, second, measured), along, strict=True)))

    slope = sum(float(np.sum(gradient * part)) for gradient, part in zip(value(0.0)[1], along, strict=True))
    assert slope == pytest.approx(float(value(1e-6)[0] - value(-1e-6)[0]) / 2e-6, rel=1e-6, abs=1e-9)


def test_slopes_in_the_dark_are_finite():
    dark = jnp.zeros(6)
    _, gradients = total(dark, dark, jnp.ones(6))
    assert all(np.all(np.isfinite(g)) for g in gradients)
