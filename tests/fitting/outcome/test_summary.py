"""From a minimum to numbers and a verdict: the exact session at its true motion, and minima made up beside it."""

import dataclasses
import json
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import build_problem
from fitting.outcome.summary import summarize
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.refine import Refined, refine
from fitting.starts.multi_start import Starts
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

pytestmark = pytest.mark.slow

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "a-nominal-exact.RAW_SUN"
ROOM_S = 6.0  # As a whole fit has it, whose programs are then used.
NOISE = 2e-3


class Minimum:
    """The exact session with the state free, refined from its true motion."""

    def __init__(self):
        settings = FitSettings(free="state")
        self.data = prepare_session(read_telemetry(SESSION)).observations()
        self.truth = {
            k: np.array(v) for k, v in json.loads(SESSION.with_suffix(".truth.json").read_text()).items() if k != "cfg"
        }
        self.problem = build_problem(self.data, noise=NOISE, max_step=16.0, room_for=ROOM_S)
        self.parameters = parametrization(nominal_model(read_satellite()), (), settings.prior_sigma)
        x = np.concatenate([np.zeros(3), self.truth["w"][0] / RATE_UNIT])[None]
        weight = np.asarray(self.problem.valid).astype(float)
        weight[: len(self.data.t)][(self.data.currents.max(axis=1) > 0.006) != self.truth["lit"]] = 0.0
        starts = Starts(x, self.truth["q"][:1], np.zeros(1))
        weight = np.repeat(weight[:, None], 6, axis=1)
        self.refined = refine(
            self.problem, self.parameters, starts, weight, likelihood="trimmed", progress=lambda *_: None
        )

    def summarize(self, refined: Refined | None = None, **options):
        return summarize(self.data.t, self.problem, self.parameters, refined or self.refined, **options)

    def with_second(self, turn_deg: float, score: float) -> Refined:
        """A copy of the minimum turned about body x, whose score (half a chi2) lies `score` above the best."""
        turn = Rotation.from_euler("x", turn_deg, degrees=True)

        def both(leaf):
            return np.concatenate([leaf, leaf])

        points = jax.tree.map(both, self.refined.points)
        q = points.prediction.quaternion.copy()
        q[1] = (Rotation.from_quat(q[1][:, [1, 2, 3, 0]]) * turn).as_quat()[:, [3, 0, 1, 2]]
        points = eqx.tree_at(lambda p: p.prediction.quaternion, points, q)
        scores = self.refined.score[0] + np.array([0.0, score])
        return Refined(points, scores, both(self.refined.limited), both(self.refined.hopeless))


@pytest.fixture(scope="module")
def minimum():
    return Minimum()


@pytest.fixture(scope="module")
def result(minimum):
    return minimum.summarize()


def test_arrays_are_those_of_the_session(minimum, result):
    np.testing.assert_array_equal(result.t_s, minimum.data.t)
    np.testing.assert_allclose(result.measured_mA, 1e3 * minimum.data.currents, rtol=1e-14)
    assert np.array_equal(result.lit, minimum.truth["lit"])
    assert np.abs(result.field_angle_deg - minimum.truth["theta"]).max() < 0.5
    # No albedo in this session's model: all light is direct.
    np.testing.assert_allclose(result.modelled_direct_mA, result.modelled_mA, atol=1e-9)
    np.testing.assert_allclose(result.modelled_mA, minimum.truth["currents_clean"], atol=3.0)


def test_chi2_and_rms_are_those_of_the_weighted_residuals(minimum, result):
    used = result.weight > 0
    residual = (result.modelled_mA - result.measured_mA)[used]
    assert result.chi2 == pytest.approx(np.sum((residual / (1e3 * NOISE)) ** 2), rel=1e-9)
    assert result.dof == used.sum() - 6
    assert result.residual_rms_mA == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)
    # The only error is the rounding to 1 mA.
    assert 0.2 < result.residual_rms_mA < 0.4
    # A panel in the dark that reads zero says nothing; one that reads something counts.
    assert used[result.measured_mA > 0][result.lit.repeat(6).reshape(-1, 6)[result.measured_mA > 0]].mean() > 0.98
    assert not used[~result.lit].any()


def test_sigmas_are_those_of_the_information_matrix(minimum, result):
    cov = np.linalg.inv(minimum.refined.points.hessian[0])
    np.testing.assert_allclose(result.attitude_sigma_deg[0], np.degrees(np.sqrt(np.diagonal(cov)[:3])), rtol=1e-6)
    assert np.all(result.field_angle_sigma_deg > 0) and result.field_angle_sigma_deg.max() < 0.5
    expected = cov[0, 5] / np.sqrt(cov[0, 0] * cov[5, 5])
    assert result.correlations["attitude.x"]["rate.z"] == pytest.approx(expected, abs=1e-4)
    assert len(result.correlations) == 5


def test_one_minimum_is_converged(result):
    assert (result.status, result.message) == ("converged", "one motion explains the data")
    assert result.alternatives == () and result.gauge is None


def test_another_motion_as_good_is_ambiguous(minimum):
    result = minimum.summarize(minimum.with_second(20.0, 1.0))
    assert result.status == "ambiguous" and "2 different motions" in result.message
    (other,) = result.alternatives
    assert other["attitude_distance_deg"] == pytest.approx(20.0, abs=0.01)
    assert other["chi2_above_best"] == pytest.approx(2.0, abs=1e-3)


def test_a_worse_motion_is_an_alternative_and_no_more(minimum):
    result = minimum.summarize(minimum.with_second(20.0, 40.0))
    assert result.status == "converged" and len(result.alternatives) == 1


def test_the_same_motion_twice_is_one(minimum):
    result = minimum.summarize(minimum.with_second(0.5, 1.0))
    assert result.status == "converged" and result.alternatives == ()


def test_failures_are_not_converged(minimum):
    # A slope of one sigma in each direction: half a unit of cost for each, whatever the solver's damping says.
    slope = np.sqrt(np.diagonal(minimum.refined.points.hessian, axis1=1, axis2=2))
    points = eqx.tree_at(lambda p: p.gradient, minimum.refined.points, slope)
    stopped = dataclasses.replace(minimum.refined, points=points)
    result = minimum.summarize(stopped)
    assert result.status == "not_converged" and "stopped short" in result.message
    hopeless = dataclasses.replace(minimum.refined, hopeless=np.array([True]))
    assert minimum.summarize(hopeless).status == "not_converged"


def test_residuals_beyond_the_noise_are_not_converged_and_leave_the_sigmas(minimum, result):
    residual = minimum.refined.points.prediction.residual
    wide = residual + 3.0 * np.sign(residual)
    points = eqx.tree_at(lambda p: p.prediction.residual, minimum.refined.points, wide)
    bad = minimum.summarize(dataclasses.replace(minimum.refined, points=points))
    assert bad.status == "not_converged" and "times the noise" in bad.message
    ratio = bad.chi2 / bad.dof
    assert ratio > 4.0
    # Sigmas rest on the stated noise; the message says that it is not that of the data.
    np.testing.assert_allclose(bad.attitude_sigma_deg, result.attitude_sigma_deg, rtol=1e-9)


def test_a_shadow_that_contradicts_the_currents_is_said_and_then_not_converged(minimum):
    few = minimum.summarize(minimum.refined, dark_disagreement=2)
    assert few.status == "converged" and "2 samples left out where currents and computed shadow" in few.message
    many = minimum.summarize(minimum.refined, dark_disagreement=30)
    assert many.status == "not_converged" and "check epoch, orbit and Sun" in many.message


def test_left_out_samples_are_counted(minimum):
    limited = minimum.refined.limited.copy()
    limited[0, 3:6] = True
    result = minimum.summarize(dataclasses.replace(minimum.refined, limited=limited))
    assert "3 samples left out" in result.message and result.limited.sum() == 3


@pytest.mark.parametrize(("dimmed", "status"), [(False, "not_converged"), (True, "converged")])
def test_samples_left_out_must_be_dim(minimum, dimmed, status):
    """A limited charge current only takes away: leaving out samples as bright as modelled hides a wrong model."""
    limited = np.zeros_like(minimum.refined.limited)
    limited[0, np.flatnonzero(minimum.truth["lit"])[:8]] = True
    points = minimum.refined.points
    # Twice the light of which the panels gave the measured half.
    more = np.asarray(minimum.problem.measured) / float(minimum.problem.noise) * (dimmed * limited[0, :, 0])[:, None]
    points = eqx.tree_at(lambda p: p.prediction.residual, points, points.prediction.residual + more)
    points = eqx.tree_at(lambda p: p.weight, points, np.where(limited, 0.0, points.weight))
    refined = Refined(points, minimum.refined.score, limited, minimum.refined.hopeless)
    found = minimum.summarize(refined)
    assert found.status == status
    assert ("no limited current dims them" in found.message) is not dimmed
