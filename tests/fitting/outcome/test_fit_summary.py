"""From a minimum to numbers and a verdict: a session at its true motion, and minima made up beside it."""

import dataclasses

import equinox as eqx
import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.identify import Identified, Minimum
from fitting.outcome.summary import summarize
from fitting.solvers.refine import Refined
from fitting.starts.conventions import Convention

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def minimum(true_minimum):
    return true_minimum("state", at_truth=True)


def summarized(minimum, refined: Refined | None = None):
    samples = minimum.samples
    best = Minimum(Convention({}, 0.0), minimum.problem, refined or minimum.refined)
    return summarize(Identified((best,), samples, minimum.parameters, len(samples.t), 6.0, {}))


def with_second(minimum, turn_deg: float, score: float) -> Refined:
    """A copy of the minimum turned about body x, whose score (half a chi2) lies `score` above the best."""
    turn = Rotation.from_euler("x", turn_deg, degrees=True)
    refined = minimum.refined

    def both(leaf):
        return np.concatenate([leaf, leaf])

    points = jax.tree.map(both, refined.points)
    q = points.prediction.quaternion.copy()
    q[1] = (Rotation.from_quat(q[1], scalar_first=True) * turn).as_quat(scalar_first=True)
    points = eqx.tree_at(lambda p: p.prediction.quaternion, points, q)
    return Refined(points, refined.score[0] + np.array([0.0, score]), both(refined.limited), both(refined.hopeless))


@pytest.fixture(scope="module")
def result(minimum):
    return summarized(minimum)


def test_chi2_and_rms_are_those_of_the_weighted_residuals(result):
    cells = result.channels["cells"]
    used = cells.weight > 0
    residual = (cells.modelled - cells.measured)[used]
    noise = np.hypot(2.0, 1.0 / np.sqrt(12.0))
    assert result.chi2 == pytest.approx(np.sum((residual / noise) ** 2), rel=1e-9)
    assert result.dof == used.sum() - 6
    assert result.residual_rms_mA == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)


def test_sigmas_are_those_of_the_information_matrix(minimum, result):
    state = np.asarray(minimum.refined.points.hessian[0])[:6, :6]
    cov = np.linalg.inv(state)
    np.testing.assert_allclose(result.attitude_sigma_deg[0], np.degrees(np.sqrt(np.diagonal(cov)[:3])), rtol=1e-6)
    assert np.all(result.field_angle_sigma_deg > 0) and result.field_angle_sigma_deg.max() < 0.5
    expected = cov[0, 5] / np.sqrt(cov[0, 0] * cov[5, 5])
    assert result.correlations["attitude.x"]["rate.z"] == pytest.approx(expected, abs=1e-4)
    assert len(result.correlations) == 5


def test_one_minimum_is_converged(result):
    assert (result.status, result.verdict) == ("converged", "fits")
    assert result.alternatives == () and result.gauge is None


def test_another_motion_as_good_is_ambiguous(minimum):
    result = summarized(minimum, with_second(minimum, 20.0, 1.0))
    assert result.status == "ambiguous" and "2 motions explain the data equally well" in result.message
    (other,) = result.alternatives
    assert other["attitude_distance_deg"] == pytest.approx(20.0, abs=0.01)
    assert other["chi2_above_best"] == pytest.approx(2.0, abs=1e-3)


def test_a_worse_motion_is_an_alternative_and_no_more(minimum):
    result = summarized(minimum, with_second(minimum, 20.0, 40.0))
    assert result.status == "converged" and len(result.alternatives) == 1


def test_the_same_motion_twice_is_one(minimum):
    result = summarized(minimum, with_second(minimum, 0.5, 1.0))
    assert result.status == "converged" and result.alternatives == ()


def test_other_axes_of_the_same_motion_are_told_within_chance_alone(minimum):
    axes = Convention({"mag": np.eye(3)}, 0.0), Convention({"mag": np.eye(3)[[1, 2, 0]]}, 0.0)

    def found(above):
        refined = dataclasses.replace(minimum.refined, score=minimum.refined.score + above)
        both = Minimum(axes[0], minimum.problem, minimum.refined), Minimum(axes[1], minimum.problem, refined)
        return summarize(Identified(both, minimum.samples, minimum.parameters, len(minimum.samples.t), 6.0, {}))

    near, far = found(1.0), found(40.0)
    assert near.status == "ambiguous" and "2 conventions of axes" in near.message and len(near.alternatives) == 1
    assert far.status == "converged" and far.alternatives == ()


def test_failures_are_not_converged(minimum):
    # A rate of three sigmas off, as far as it is known beside all others.
    points = minimum.refined.points
    off = np.zeros_like(np.asarray(points.x))
    off[0, 3] = 3.0 * np.sqrt(np.linalg.inv(np.asarray(points.hessian)[0])[3, 3])
    slope = np.einsum("nuv,nv->nu", np.asarray(points.hessian), off)
    away = eqx.tree_at(lambda p: (p.x, p.gradient), points, (np.asarray(points.x) + off, slope))
    result = summarized(minimum, dataclasses.replace(minimum.refined, points=away))
    assert result.status == "not_converged" and "stopped short" in result.message
    # The same slope on a kink, where no step saves what it promises.
    kinked = eqx.tree_at(lambda p: p.gradient, points, slope)
    assert summarized(minimum, dataclasses.replace(minimum.refined, points=kinked)).status == "converged"
    hopeless = dataclasses.replace(minimum.refined, hopeless=np.array([True]))
    assert summarized(minimum, hopeless).status == "not_converged"


def test_left_out_samples_are_counted(minimum):
    limited = minimum.refined.limited.copy()
    limited[0, 3:6, 0] = True
    result = summarized(minimum, dataclasses.replace(minimum.refined, limited=limited))
    assert result.limited is not None and result.limited.sum() == 3 and (~result.channels["cells"].used).sum() == 3
    assert any(remark.startswith("3 of 71 samples of cells left out") for remark in result.remarks)
