"""Residuals of a short arc with everything free: exact Jacobians, padding, and models that are the same motion."""

import dataclasses
import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import build_problem
from fitting.measurements.problem import Problem
from fitting.parameters.names import MODEL, STATE
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import PriorSigma
from fitting.solvers import least_squares
from fitting.solvers.least_squares import Settings, priors
from fitting.starts.multi_start import NONE
from jaxsat.integrators import BLOCK
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

pytestmark = pytest.mark.slow

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "d-mixed-albedo.RAW_SUN"
SAMPLES = 8
NAMES = STATE + MODEL


class Arc:
    """The first samples of a session, everything free, at the true attitude and rate with the nominal satellite."""

    def __init__(self):
        satellite = read_satellite(changed={"albedo.specular": 0.2, "albedo.diffuse": 0.3})
        whole = prepare_session(read_telemetry(SESSION)).observations()
        self.observations = dataclasses.replace(
            whole, t=whole.t[:SAMPLES], currents=whole.currents[:SAMPLES], sun_eci=whole.sun_eci[:SAMPLES]
        )
        self.problem = build_problem(self.observations, noise=2e-3, max_step=16.0)
        self.nominal = nominal_model(satellite)
        self.parameters = parametrization(self.nominal, MODEL, PriorSigma())
        true = json.loads(SESSION.with_suffix(".truth.json").read_text())
        self.reference = np.array(true["q"][0])
        self.x = 0.3 * np.random.default_rng(4).normal(size=len(NAMES))
        self.x[:3] *= 0.1
        self.x[3:6] += np.array(true["w"][0]) / RATE_UNIT
        self._predict = eqx.filter_jit(Problem.predict)

    def predict(self, x=None, parameters=None, problem=None, blocks=100):
        x = jnp.asarray(self.x if x is None else x)
        prediction, jacobian = self._predict(
            problem or self.problem, parameters or self.parameters, x, jnp.asarray(self.reference), jnp.asarray(blocks)
        )
        return prediction, np.asarray(jacobian)


@pytest.fixture(scope="module")
def arc():
    return Arc()


@pytest.fixture(scope="module")
def blocks(arc):
    return -(-int(arc.problem.grid.sample_index[SAMPLES - 1]) // BLOCK)


def rotation(q) -> Rotation:
    return Rotation.from_quat(np.asarray(q)[..., [1, 2, 3, 0]])


def test_jacobians_are_central_differences(arc, blocks):
    """Steps of 1e-5 of residuals near 100 sigma: the difference knows about 1e-8 / 1e-5 of rounding and h^2 = 1e-10."""
    prediction, jacobian = arc.predict(blocks=blocks)
    h = 1e-5
    assert jacobian.shape[-1] == len(NAMES) == 38
    for k, name in enumerate(NAMES):
        shift = h * np.eye(len(NAMES))[k]
        high, low = (arc.predict(arc.x + s, blocks=blocks)[0] for s in (shift, -shift))
        numeric = (np.asarray(high.residual) - np.asarray(low.residual))[:SAMPLES] / (2 * h)
        exact = jacobian[:SAMPLES, :, k]
        np.testing.assert_allclose(exact, numeric, atol=2e-6 * max(np.abs(numeric).max(), 1.0), err_msg=name)
        turn = (rotation(low.quaternion).inv() * rotation(high.quaternion)).as_rotvec()[:SAMPLES] / (2 * h)
        exact = np.asarray(prediction.rotation_jacobian)[:SAMPLES, :, k]
        np.testing.assert_allclose(exact, turn, atol=1e-6 * max(np.abs(turn).max(), 1e-3), err_msg=name)


def test_every_unknown_but_the_gauges_is_felt(arc, blocks):
    _, jacobian = arc.predict(blocks=blocks)
    assert np.all(np.abs(jacobian[:SAMPLES]).max(axis=(0, 1)) > 1e-6)


def test_common_scale_of_inertia_magnet_and_rods_is_no_motion(arc, blocks):
    """What the gauge rests on: torques and inertia grow alike, whatever the attitude."""
    arrays = {name: 1.3 * getattr(arc.nominal, name) for name in ("inertia", "magnet", "rods")}
    scaled = parametrization(dataclasses.replace(arc.nominal, **arrays), MODEL, PriorSigma())
    x = np.concatenate([arc.x[:6], np.zeros(len(MODEL))])
    plain, other = (arc.predict(x, parameters, blocks=blocks)[0] for parameters in (arc.parameters, scaled))
    np.testing.assert_allclose(other.quaternion[:SAMPLES], plain.quaternion[:SAMPLES], atol=1e-12)
    heavier = dataclasses.replace(arc.nominal, inertia=1.3 * arc.nominal.inertia)
    other = arc.predict(x, parametrization(heavier, MODEL, PriorSigma()), blocks=blocks)[0]
    assert np.abs(other.quaternion - plain.quaternion)[:SAMPLES].max() > 1e-3


def test_a_shorter_arc_has_the_same_samples(arc, blocks):
    whole, whole_jacobian = arc.predict(blocks=blocks)
    short, jacobian = arc.predict(blocks=3)
    reached = int(np.sum(np.asarray(arc.problem.grid.sample_index)[:SAMPLES] <= 3 * BLOCK))
    assert 1 < reached < SAMPLES
    np.testing.assert_array_equal(short.residual[:reached], whole.residual[:reached])
    np.testing.assert_array_equal(jacobian[:reached], whole_jacobian[:reached])


@pytest.mark.parametrize("number", [3, 100], ids=["short", "beyond the end"])
def test_padding_and_samples_after_the_arc_count_for_nothing(arc, blocks, number):
    number = min(number, blocks)
    inside = np.asarray(arc.problem.valid) & (np.asarray(arc.problem.grid.sample_index) <= number * BLOCK)
    prediction, jacobian = arc.predict(blocks=number)
    assert np.all(np.isfinite(prediction.residual)) and np.all(np.isfinite(jacobian))
    assert len(inside) == 16 and not inside[SAMPLES:].any()

    none, each = jnp.asarray(NONE), np.repeat(inside.astype(float)[:, None], 6, axis=1)
    settings = Settings(jnp.asarray(0), jnp.asarray(1), jnp.asarray(3.0), jnp.ones(len(NAMES), bool), none, none)
    floor = jnp.asarray(arc.problem.floor)
    equations = jax.jit(least_squares.normal_equations, static_argnums=5)
    data = equations(prediction.residual, jnp.asarray(jacobian), jnp.asarray(each), settings, floor, arc.problem.groups)
    cost, gradient, hessian = (np.asarray(a + b) for a, b in zip(data, priors(jnp.asarray(arc.x)), strict=True))
    r, J = np.asarray(prediction.residual)[inside].ravel(), jacobian[inside].reshape(-1, len(NAMES))
    c = 3.0
    weight = 1.0 / np.sqrt(1.0 + (r / c) ** 2)
    prior = np.concatenate([np.zeros(6), arc.x[6:]])
    expected = np.sum(c**2 * (np.sqrt(1.0 + (r / c) ** 2) - 1.0)) + 0.5 * prior @ prior
    assert float(cost) == pytest.approx(expected, rel=1e-12)
    gradient_expected = J.T @ (weight * r) + prior
    np.testing.assert_allclose(gradient, gradient_expected, rtol=1e-9, atol=1e-9 * np.abs(gradient_expected).max())
    information = J.T @ (weight[:, None] * J) + np.diag([0.0] * 6 + [1.0] * len(MODEL))
    root = np.sqrt(np.diagonal(information))
    np.testing.assert_allclose(hessian / np.outer(root, root), information / np.outer(root, root), atol=1e-12)


def test_residuals_are_in_units_of_the_noise(arc, blocks):
    """With the currents of another satellite attitude measured, residuals move by the change over the noise."""
    shifted = eqx.tree_at(lambda p: p.measured, arc.problem, arc.problem.measured + 5e-3)
    plain = arc.predict(blocks=blocks)[0].residual[:SAMPLES]
    np.testing.assert_allclose(
        arc.predict(problem=shifted, blocks=blocks)[0].residual[:SAMPLES], plain - 2.5, atol=1e-9
    )
