"""Draws about the minimum of a session scatter as its information matrix says; the density has the slope it gives."""

import sys

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.outcome.posterior import build_target, draw_from, load_blackjax
from jaxsat.errors import InputError

SAMPLES = 24


@pytest.fixture(scope="module")
def minimum(true_minimum):
    """Of the session with its state free and everything else at the truth."""
    # A third of the session is motion enough for its state; a slope is off by what a step is, at 8 s by 1e-5.
    return true_minimum("state", samples=SAMPLES, at_truth=True, step_s=8.0)


@pytest.fixture(scope="module")
def target(minimum):
    return build_target(minimum.problem, minimum.parameters, minimum.refined)


def test_without_blackjax_the_reason_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "blackjax", None)
    with pytest.raises(InputError, match="needs BlackJAX, which is not installed: pip install blackjax"):
        load_blackjax()


@pytest.mark.slow
def test_log_density_has_the_slope_of_finite_differences(minimum, target):
    u = jnp.array([0.5, -1.0, 0.3, 1.2, -0.4, 0.8])
    density = eqx.filter_jit(lambda target, u: eqx.filter_value_and_grad(lambda v: target.log_density(v))(u))
    value, slope = density(target, u)
    h = 1e-3
    steps = [(density(target, u + h * e)[0] - density(target, u - h * e)[0]) / (2 * h) for e in jnp.eye(6)]
    np.testing.assert_allclose(slope, steps, rtol=1e-4, atol=1e-4)
    # Near a unit normal about the minimum: the log density falls by half the square of u.
    fall = -float(value) - float(minimum.refined.points.cost[0])
    assert fall == pytest.approx(0.5 * float(u @ u), rel=0.1)


@pytest.mark.slow
def test_draws_scatter_by_the_sigmas_of_the_information_matrix(minimum, target):
    pytest.importorskip("blackjax")
    posterior = draw_from(target, minimum.parameters, draws=75, warmup=25, chains=2, seed=3)
    assert posterior.samples.shape == (2, 75, 6) and posterior.divergences == 0
    assert posterior.names == minimum.parameters.names[:6] and posterior.units == ("deg",) * 3 + ("deg/s",) * 3
    # 90 independent draws tell a sigma to 7.5 %; 25 % is three times that.
    assert posterior.effective_samples.min() > 90 and posterior.split_r_hat.max() < 1.05
    sigma = np.degrees(np.sqrt(np.diagonal(np.linalg.inv(minimum.refined.points.hessian[0][:6, :6]))))
    sigma[3:] *= RATE_UNIT
    np.testing.assert_allclose(list(posterior.sigma().values()), sigma, rtol=0.25)
    rate = posterior.samples[..., 3:].mean(axis=(0, 1))
    best = np.degrees(minimum.refined.points.x[0, 3:6]) * RATE_UNIT
    # The mean of as many: 0.1 sigma, three times that.
    assert np.all(np.abs(rate - best) < 0.3 * sigma[3:])
