"""Slopes of means: exact on quadratics, true within their errors for what has no derivative, and descents by them."""

import math

import numpy as np
import pytest

from fitting.sensitivity.design import MeanSlopes, descended, slopes_of_mean

STARTS = 400


def chaotic(x, start, times=60):
    """The logistic map after many turns: its derivative by x is astronomical, its mean moves slowly."""
    for _ in range(times):
        start = x * start * (1.0 - start)
    return start


def test_of_a_quadratic_they_are_its_gradient_without_error():
    bend = np.array([[2.0, 0.3], [0.3, -1.0]])

    def metric(designs):
        return designs @ [1.0, -4.0] + 0.5 * np.einsum("ki,ij,kj->k", designs, bend, designs)

    at = np.array([0.7, -0.2])
    found = slopes_of_mean(metric, at, 0.1, 50, seed=3)
    np.testing.assert_allclose(found.slopes, [1.0, -4.0] + bend @ at, rtol=1e-10)
    assert np.all(found.sigma < 1e-10)


def test_of_a_staircase_it_is_the_slope_of_its_smoothed_mean_within_the_error_that_is_told():
    # The mean of a step is the normal distribution function, whose slope at x is the density over s.
    at, width, seeds = 0.1, 0.2, 60
    off = []
    for seed in range(seeds):
        found = slopes_of_mean(lambda x: np.where(x[:, 0] > 0.0, 1.0, 0.0), [at], width, STARTS, seed=seed)
        density = math.exp(-0.5 * (at / width) ** 2) / (width * math.sqrt(2.0 * math.pi))
        off.append((found.slopes[0] - density) / found.sigma[0])
    # Mean and spread of so many errors in their own sigma.
    assert abs(np.mean(off)) < 4.0 / math.sqrt(seeds)
    assert 0.75 < np.std(off) < 1.3


def test_the_slope_of_a_chaotic_mean_is_that_of_a_brute_average():
    rng = np.random.default_rng(0)
    starts = rng.uniform(0.1, 0.9, 4000)

    def metric(designs):
        return chaotic(np.clip(designs[:, 0], 0.0, 4.0), np.concatenate([starts, starts]))

    found = slopes_of_mean(metric, [3.8], 0.03, len(starts))
    own = [
        np.mean(chaotic(3.8 + 0.03 * rng.standard_normal(100_000) + by, rng.uniform(0.1, 0.9, 100_000)).clip(0, 1))
        for by in (-0.01, 0.01)
    ]
    assert abs(found.slopes[0] - (own[1] - own[0]) / 0.02) < 4.0 * math.hypot(found.sigma[0], 0.08)
    # A derivative along the motion, which is exact, is of another size altogether.
    small = chaotic(3.8 + 1e-12, starts[:100], 30) - chaotic(3.8, starts[:100], 30)
    assert np.median(np.abs(small)) / 1e-12 > 1e3 * abs(found.slopes[0])


def test_starts_without_a_value_are_left_out_and_counted():
    def metric(designs):
        return np.where(np.arange(len(designs)) % STARTS < 10, np.nan, designs[:, 0])

    found = slopes_of_mean(metric, [2.0], 0.1, STARTS)
    assert found.left_out == 10
    np.testing.assert_allclose(found.slopes, [1.0])
    with pytest.raises(ValueError, match="only 0 of"):
        slopes_of_mean(lambda x: np.full(len(x), np.nan), [2.0], 0.1, STARTS)
    with pytest.raises(ValueError, match="positive widths"):
        slopes_of_mean(metric, [2.0], 0.0, STARTS)
    with pytest.raises(ValueError, match="shape"):
        slopes_of_mean(lambda x: x, [2.0], 0.1, STARTS)


def test_a_descent_finds_the_least_inside_and_stays_at_bounds():
    best = np.array([0.3, 2.0])

    def slopes_at(design, number):
        noise = np.random.default_rng(number).normal(size=2)
        return MeanSlopes(0.0, 0.0, (design - best) + 0.05 * noise, np.full(2, 0.05), 0)

    low, high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    found, way = descended(slopes_at, np.array([-0.9, -0.9]), low=low, high=high, step=0.5, steps=60)
    # The second number wants to go beyond its bound. Steps are still 0.06 at the end.
    np.testing.assert_allclose(found, [0.3, 1.0], atol=0.06)
    assert len(way) == 60
    with pytest.raises(ValueError, match="low < high"):
        descended(slopes_at, best, low=high, high=low, step=0.5, steps=60)
