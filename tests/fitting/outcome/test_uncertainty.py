"""Sigmas against a plain matrix inverse and against the scatter of small random rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.outcome.uncertainty import (
    attitude_covariance,
    correlations,
    covariance,
    field_angle_sigma,
    scatter_directions,
)

RNG = np.random.default_rng(0)


def information(n: int, spread: float = 0.0) -> np.ndarray:
    root = RNG.normal(size=(3 * n, n)) * 10.0 ** RNG.uniform(-spread, spread, size=n)
    return root.T @ root


@pytest.mark.parametrize("spread", [0.0, 4.0])
def test_covariance_is_the_inverse_over_what_is_free(spread):
    matrix = information(8, spread)
    free = np.array([1, 1, 0, 1, 1, 1, 0, 1], bool)
    result = covariance(matrix, free)
    inverse = np.linalg.inv(matrix[np.ix_(free, free)])
    sigma = np.sqrt(np.diagonal(inverse))
    np.testing.assert_allclose(
        result[np.ix_(free, free)] / np.outer(sigma, sigma), inverse / np.outer(sigma, sigma), atol=1e-9
    )
    assert not np.any(result[~free]) and not np.any(result[:, ~free])


def test_directions_that_the_data_do_not_see_are_infinite():
    everything = np.ones(4, bool)
    # The data know the sum of 0 and 1, nothing of 2, and 3 by itself.
    rows = np.array([[1.0, 1.0, 0.0, 0.0], [2.0, 2.0, 0.0, 1e-3], [0.0, 0.0, 0.0, 5e-3]])
    result = covariance(rows.T @ rows, everything)
    assert np.all(np.isinf(np.diagonal(result)[:3]))
    assert np.isfinite(result[3, 3]) and not np.any(np.isnan(result))
    assert np.all(np.isfinite(result[~np.eye(4, dtype=bool)]))
    reduced = rows[:, [0, 3]]
    assert result[3, 3] == pytest.approx(np.linalg.inv(reduced.T @ reduced)[1, 1])


def test_what_rounding_hides_is_known_as_well_as_by_the_priors():
    # Two unknowns with a prior sigma of 1 whose difference the data see 1e9 times worse than their sum, below rounding
    # beside their information of 1e18; by hand the difference has the prior's variance.
    rows = 1e9 * np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    matrix = rows.T @ rows + np.diag([1.0, 1.0, 0.0])
    result = covariance(matrix, np.ones(3, bool), prior=np.array([1.0, 1.0, 0.0]))
    np.testing.assert_allclose(result[:2, :2], 0.5 * np.array([[1.0, -1.0], [-1.0, 1.0]]), rtol=1e-6)
    assert result[2, 2] == pytest.approx(1e-18)
    # What has no prior stays unknown.
    assert np.all(np.isinf(np.diagonal(covariance(matrix, np.ones(3, bool), prior=np.zeros(3)))[:2]))


def test_covariance_of_no_unknown_is_zero():
    assert not np.any(covariance(information(3), np.zeros(3, bool)))


def test_correlations_name_each_pair_of_free_parameters_once():
    cov = np.array([[4.0, 3.0, 0.0, 0.0], [3.0, 9.0, -1.5, 0.0], [0.0, -1.5, 1.0, 0.0], [0.0, 0.0, 0.0, np.inf]])
    result = correlations(["a", "b", "c", "d"], cov, {"a", "b", "c", "d"})
    assert result == {"a": {"b": 0.5, "c": 0.0}, "b": {"c": -0.5}}
    assert correlations(["a", "b", "c", "d"], cov, {"a", "c"}) == {"a": {"c": 0.0}}


def test_attitude_and_field_angle_scatter_as_stated():
    """Monte-Carlo: unknowns drawn from their covariance turn the body by small rotations; 20 000 draws give 0.5 %."""
    samples, unknowns, draws = 5, 8, 20_000
    cov = 1e-8 * np.linalg.inv(information(unknowns))
    jacobian = RNG.normal(size=(samples, 3, unknowns))
    field_body = RNG.normal(size=(samples, 3)) * 3e-5
    rotations = np.einsum("siu,du->dsi", jacobian, RNG.multivariate_normal(np.zeros(unknowns), cov, size=draws))
    rotation_covariance = attitude_covariance(jacobian, cov)
    for k in range(samples):
        sampled = np.cov(rotations[:, k].T)
        scale = np.sqrt(np.outer(np.diagonal(sampled), np.diagonal(sampled)))
        np.testing.assert_allclose(rotation_covariance[k] / scale, sampled / scale, atol=0.04)
        # q exp(r): the body turns by r in its own axes, so the field in them turns by -r.
        turned = Rotation.from_rotvec(-rotations[:, k]).apply(field_body[k])
        angle = np.arccos(turned[:, 0] / np.linalg.norm(turned, axis=1))
        assert field_angle_sigma(field_body, rotation_covariance)[k] == pytest.approx(np.std(angle), rel=0.03)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_field_along_x_takes_the_larger_transverse_sigma(direction):
    turn = Rotation.from_rotvec([0.6, 0.0, 0.0]).as_matrix()
    rotation_covariance = turn @ np.diag([9.0, 1.0, 4.0]) @ turn.T * 1e-6
    field = np.array([[direction * 3e-5, 0.0, 0.0]])
    assert field_angle_sigma(field, rotation_covariance[None])[0] == pytest.approx(2e-3)


def test_the_attitude_is_unknown_where_a_blind_unknown_moves_it():
    cov = np.diag([1e-6, np.inf])
    jacobian = np.ones((2, 3, 2))
    jacobian[1, :, 1] = 0.0
    result = attitude_covariance(jacobian, cov)
    assert np.all(np.isinf(result[0]))
    np.testing.assert_allclose(result[1], 1e-6)
    sigma = field_angle_sigma(np.array([[0.0, 3e-5, 0.0]] * 2), result)
    assert np.isinf(sigma[0]) and sigma[1] == pytest.approx(1e-3)


@pytest.mark.parametrize("size", [0.0, 0.3, 20.0])
def test_squares_of_predicted_errors_scatter_as_those_of_so_many_directions(size):
    rng = np.random.default_rng(5)
    jacobian, root = rng.normal(size=(40, 3)), size * np.diag([1.0, 0.3, 0.1])
    cov = np.zeros((4, 4))
    cov[:3, :3], cov[3, 3] = root @ root.T, np.inf
    drawn = rng.normal(size=(40000, 40)) + rng.normal(size=(40000, 3)) @ (jacobian @ root).T
    squares = (drawn**2).sum(axis=1)
    found = scatter_directions(np.column_stack([jacobian, np.ones(40)]), cov)
    # The variance of chi-square of nu degrees is twice its mean squared over nu.
    assert found == pytest.approx(2.0 * squares.mean() ** 2 / squares.var(), rel=0.05)
