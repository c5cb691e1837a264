"""Readings at the floor: the loss against SciPy, its slopes, and faint light that is not made brighter by it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import norm

from fitting.measurements import floor as censored
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.groups import Group
from fitting.solvers import least_squares
from fitting.solvers.least_squares import Settings
from fitting.starts.multi_start import NONE

LIMIT = 0.25
at_floor, normal_equations = jax.jit(censored.at_floor), jax.jit(least_squares.normal_equations, static_argnums=5)


@pytest.mark.slow
def test_loss_is_that_of_a_censored_reading():
    u = np.array([1.0, 2.0, 5.0, 40.0, 500.0])
    loss, half_slope, _ = (np.asarray(a) for a in at_floor(jnp.asarray(u), jnp.full(5, LIMIT)))
    expected = 2.0 * (norm.logcdf(LIMIT) - norm.logcdf(LIMIT - u))
    # Softening moves a current of a sigma by 3 % of one, and a brighter one by less.
    np.testing.assert_allclose(loss, expected, rtol=0.06)
    np.testing.assert_allclose(loss[2:], expected[2:], rtol=0.01)
    np.testing.assert_allclose(half_slope, np.exp(norm.logpdf(u - LIMIT) - norm.logcdf(LIMIT - u)), rtol=0.02)


@pytest.mark.slow
def test_slopes_and_curvature():
    u = jnp.asarray([0.0, 1e-3, 0.1, 0.3, 1.0, 3.0, 30.0])
    floor = jnp.full(7, LIMIT)
    loss, half_slope, half_curvature = at_floor(u, floor)
    slope, curvature = jax.jit(jax.vmap(jax.jacfwd(lambda u: at_floor(u, jnp.asarray(LIMIT))[:2])))(u)
    np.testing.assert_allclose(half_slope, 0.5 * slope, rtol=1e-12, atol=1e-15)
    h = 1e-5
    numeric = (at_floor(u + h, floor)[0] - at_floor(u - h, floor)[0]) / (2 * h)
    np.testing.assert_allclose(half_slope, 0.5 * numeric, rtol=1e-6, atol=1e-8)
    assert loss[0] == 0.0 and half_slope[0] == 0.0
    # The slope's derivative where that is positive; there a gain of zero is held as it should be.
    np.testing.assert_allclose(half_curvature[:4], curvature[:4], rtol=1e-9)
    np.testing.assert_allclose(half_curvature[4:], curvature[4:], rtol=0.2)
    assert np.all(np.asarray(half_curvature) > 0.0)


@pytest.mark.slow
def test_other_readings_are_plain_and_nothing_overflows():
    r = jnp.asarray([-3.0, 0.0, 0.5, 1e4])
    loss, half_slope, half_curvature = at_floor(r, jnp.full(4, NO_FLOOR))
    np.testing.assert_array_equal(loss, r**2)
    np.testing.assert_array_equal(half_slope, r)
    np.testing.assert_array_equal(half_curvature, 1.0)
    wild = jnp.asarray([0.0, 1e-12, 1e2, 1e4])
    assert all(np.all(np.isfinite(a)) for a in at_floor(wild, jnp.zeros(4)))
    slopes = jax.jit(jax.vmap(jax.grad(lambda u: at_floor(u, jnp.asarray(NO_FLOOR))[0])))(wild)
    assert np.all(np.isfinite(slopes))


@pytest.mark.slow
@pytest.mark.parametrize("light", [1.0, 2.0, 3.0])
def test_faint_light_is_not_made_brighter(light):
    """A brightness common to many readings, rounded and cut at zero, by the normal equations; all in mA."""
    noise, count = 2.0, 6000
    reading = np.maximum(np.rint(light + np.random.default_rng(3).normal(0.0, noise, (count, 6))), 0.0)
    sigma = np.hypot(noise, 1.0 / np.sqrt(12.0))
    none = jnp.asarray(NONE)
    settings = Settings(jnp.asarray(0), jnp.asarray(1), none, jnp.ones(1, bool), none, none)

    def estimate(floor):
        brightness = 2.0
        for _ in range(30):
            r = jnp.asarray((brightness - reading) / sigma)
            J = jnp.full((count, 6, 1), 1.0 / sigma)
            _, gradient, hessian = normal_equations(r, J, jnp.ones((count, 6)), settings, floor, (Group("cells", 6),))
            brightness -= float(gradient[0] / hessian[0, 0])
        return brightness, float(hessian[0, 0]) ** -0.5

    plain, _ = estimate(jnp.full((count, 6), NO_FLOOR))
    cut, spread = estimate(jnp.where(jnp.asarray(reading) == 0.0, 0.5 / sigma, NO_FLOOR))
    assert cut == pytest.approx(light, abs=4.0 * spread)
    assert plain == pytest.approx(reading.mean(), rel=1e-6)
    # Which as plain readings it would be by more than chance.
    assert plain > light + 4.0 * spread
