"""Draws about the minimum of a session scatter as its information matrix says; the density has the slope it gives."""

import dataclasses
import json
import sys
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import build_problem
from fitting.outcome.posterior import build_target, load_blackjax, sample_posterior
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.refine import refine
from fitting.starts.multi_start import Starts
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "b-specular50.RAW_SUN"
ROOM_S = 6.0  # As a whole fit has it, whose programs are then used.
SAMPLES = 24


@pytest.fixture(scope="module")
def minimum():
    """Problem, parameters and minimum of the session with its state free and everything else at the truth."""
    truth = json.loads(SESSION.with_suffix(".truth.json").read_text())
    settings = FitSettings(free="state")
    whole = prepare_session(read_telemetry(SESSION)).observations()
    # A third of the session is motion enough for its state.
    cut = {name: getattr(whole, name)[:SAMPLES] for name in ("t", "currents", "sun_eci")}
    data = dataclasses.replace(whole, **cut)
    problem = build_problem(data, noise=2.02e-3, max_step=32.0, room_for=ROOM_S, whole=whole)
    true, given = truth["cfg"], nominal_model(read_satellite())
    inertia = np.array(true["inertia"])[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    given = type(given)(
        magnet=np.array(true["magnet"]),
        rods=np.array(true["rods"]),
        reference_field=given.reference_field,
        inertia=inertia,
        max_current=1e-3 * true["imax"],
        gains=np.array(true["panel_ratio"]),
        albedo=np.array([true["albedo_specular"], true["albedo_diffuse"]]),
    )
    parameters = parametrization(given, (), settings.prior_sigma)
    x = np.concatenate([np.zeros(3), np.array(truth["w"][0]) / RATE_UNIT])[None]
    weight = np.repeat(np.asarray(problem.valid).astype(float)[:, None], 6, axis=1)
    n = len(data.t)
    weight[:n][problem.bright()[:n] != problem.sunlit()[:n]] = 0.0
    starts = Starts(x, np.array(truth["q"][:1]), np.zeros(1))
    return (
        problem,
        parameters,
        refine(problem, parameters, starts, weight, likelihood="normal", progress=lambda *_: None),
    )


def test_without_blackjax_the_reason_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "blackjax", None)
    with pytest.raises(InputError, match="needs BlackJAX, which is not installed: pip install blackjax"):
        load_blackjax()


@pytest.mark.slow
def test_log_density_has_the_slope_of_finite_differences(minimum):
    target = build_target(*minimum)
    u = jnp.array([0.5, -1.0, 0.3, 1.2, -0.4, 0.8])
    density = eqx.filter_jit(lambda target, u: eqx.filter_value_and_grad(lambda v: target.log_density(v))(u))
    value, slope = density(target, u)
    h = 1e-3
    steps = [(density(target, u + h * e)[0] - density(target, u - h * e)[0]) / (2 * h) for e in jnp.eye(6)]
    np.testing.assert_allclose(slope, steps, rtol=1e-4, atol=1e-4)
    # Near a unit normal about the minimum: the log density falls by half the square of u.
    fall = -float(value) - float(minimum[2].points.cost[0])
    assert fall == pytest.approx(0.5 * float(u @ u), rel=0.1)


@pytest.mark.slow
def test_draws_scatter_by_the_sigmas_of_the_information_matrix(minimum):
    pytest.importorskip("blackjax")
    posterior = sample_posterior(*minimum, draws=80, warmup=40, seed=3)
    assert posterior.samples.shape == (4, 80, 6) and posterior.divergences == 0
    assert posterior.names == minimum[1].names and posterior.units == ("deg",) * 3 + ("deg/s",) * 3
    # 200 independent draws tell a sigma to 5 %; 25 % is five times that.
    assert posterior.effective_samples.min() > 200 and posterior.split_r_hat.max() < 1.05
    sigma = np.degrees(np.sqrt(np.diagonal(np.linalg.inv(minimum[2].points.hessian[0]))))
    sigma[3:] *= RATE_UNIT
    np.testing.assert_allclose(list(posterior.sigma().values()), sigma, rtol=0.25)
    rate = posterior.samples[..., 3:].mean(axis=(0, 1))
    best = np.degrees(minimum[2].points.x[0, 3:]) * RATE_UNIT
    # The mean of as many: 0.07 sigma, four times that.
    assert np.all(np.abs(rate - best) < 0.3 * sigma[3:])
