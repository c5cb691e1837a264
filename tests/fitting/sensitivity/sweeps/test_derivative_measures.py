"""Derivatives over random inputs: against the closed forms of Sobol & Kucherenko 2009, and finite differences."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.sensitivity.sweeps import derivative_measures
from fitting.sensitivity.sweeps.derivatives import poincare_normal, poincare_uniform

A, B, PI = 7.0, 0.1, np.pi


def ishigami(x):
    f = jnp.sin(x[0]) + A * jnp.sin(x[1]) ** 2 + B * x[2] ** 4 * jnp.sin(x[0])
    # And one that is not a number where the first is large.
    return {"f": f, "sometimes": jnp.where(f > 9.0, jnp.nan, x[0])}


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(1).uniform(-PI, PI, (5000, 3))


@pytest.fixture(scope="module")
def found(points):
    return derivative_measures(ishigami, points, chunk=512)


def test_measures_of_the_ishigami_function(found):
    f = found["f"]
    exact = np.array([0.5 * (1.0 + 2.0 * B * PI**4 / 5.0 + B**2 * PI**8 / 9.0), A**2 / 2.0, 8.0 * B**2 * PI**6 / 7.0])
    assert f.points == 5000 and np.all(np.abs(f.mean_square - exact) < 4.0 * f.mean_square_error)
    assert np.all(f.mean_square_error < 0.05 * exact)
    # It comes back to its beginning along x1 and x2, and along x3 it is even.
    assert np.all(np.abs(f.mean_derivative) < 4.0 * f.mean_derivative_error)
    assert f.mean_size[1] == pytest.approx(A * 2.0 / PI, rel=0.03)
    total = np.array([0.5576, 0.4424, 0.2437])
    bounds = f.bounds(np.full(3, poincare_uniform(-PI, PI)))
    # Published bounds over V = 13.84, of constants (2 pi)^2/pi^2 = 4.
    np.testing.assert_allclose(bounds, 4.0 * exact / 13.84, rtol=0.1)
    assert np.all(bounds > total)


def test_bound_of_a_normal_input_is_sharp_for_a_line():
    x = np.random.default_rng(2).normal(0.0, 2.0, (400, 1))
    line = derivative_measures(lambda x: {"line": 3.0 * x[0]}, x)["line"]
    assert line.mean_square[0] == pytest.approx(9.0) and line.variance == pytest.approx(9.0 * x.var(ddof=1))
    assert line.bounds(np.array([poincare_normal(x.std(ddof=1))]))[0] == pytest.approx(1.0)


def test_derivatives_are_those_of_differences(points, found):
    def f(x):
        return np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])

    h = 1e-5
    slopes = np.stack([(f(points + h * e) - f(points - h * e)) / (2.0 * h) for e in np.eye(3)], axis=1)
    # Of rounding 1e-11, of the third derivative 1e-9.
    np.testing.assert_allclose(found["f"].mean_derivative, slopes.mean(axis=0), atol=1e-8)
    np.testing.assert_allclose(found["f"].mean_square, (slopes**2).mean(axis=0), rtol=1e-8)


def test_points_that_are_not_finite_do_not_count(points, found):
    good = np.sin(points[:, 0]) * (1.0 + B * points[:, 2] ** 4) + A * np.sin(points[:, 1]) ** 2 <= 9.0
    some = found["sometimes"]
    assert some.points == good.sum() < 5000 and some.mean == pytest.approx(points[good, 0].mean())
    np.testing.assert_array_equal(some.mean_derivative, [1.0, 0.0, 0.0])


def test_bad_inputs_are_named(points):
    with pytest.raises(ValueError, match="inputs: expected finite numbers"):
        derivative_measures(ishigami, points[:1])
    with pytest.raises(ValueError, match="output v: expected one number a point"):
        derivative_measures(lambda x: {"v": x}, points[:4], chunk=4)
    with pytest.raises(ValueError, match="output v: 0 of 4 points have a finite value"):
        derivative_measures(lambda x: {"v": jnp.nan * x[0]}, points[:4], chunk=4)
