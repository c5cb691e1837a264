"""What data tell of a fit, against closed forms of a straight line and against averages over many linear fits."""

import numpy as np
import pytest

from fitting.sensitivity.told import leverages, told


def test_of_a_straight_line():
    """Leverage 1/n + (t - mean)^2 / S and its continuation beyond the data (Hoaglin & Welsch 1978)."""
    t = np.arange(40.0)
    J, fitted = np.stack([np.ones(40), t], axis=-1), t < 12.0
    cov = np.linalg.inv(J[fitted].T @ J[fitted])
    found = told(J, fitted.astype(float), cov, ~fitted)
    spread = (t[fitted] - 5.5) ** 2
    np.testing.assert_allclose(leverages(J, fitted * 1.0, cov)[fitted], 1 / 12 + spread / spread.sum(), rtol=1e-12)
    ahead = np.sqrt(np.mean(1 / 12 + (t[~fitted] - 5.5) ** 2 / spread.sum()))
    np.testing.assert_allclose([found.by_data, found.ahead, found.missed], [2.0, ahead, np.hypot(1, ahead)], rtol=1e-12)
    assert (found.unknowns, found.readings) == (2, 12)
    np.testing.assert_allclose(found.copied, 2 / 12, rtol=1e-12)
    # Its error in the next reading is 0.62 of the noise, in the last ones above it; within the data 0.5 at most.
    near = told(J[:13], fitted[:13] * 1.0, cov, ~fitted[:13])
    assert found.tuned and not found.predicts and not near.tuned and not near.predicts
    middle = t == 5.0
    assert told(J, fitted * ~middle * 1.0, np.linalg.inv(J[fitted & ~middle].T @ J[fitted & ~middle]), middle).predicts


def test_averages_over_fits_with_priors():
    """Squares in sample n - tr H, own error tr H, ahead 1 + j C j; what is left and what is wrong independent."""
    rng = np.random.default_rng(3)
    J = rng.normal(size=(14, 6)) * np.array([3.0, 2.0, 1.0, 0.5, 0.2, 0.01])
    fitted, draws = np.arange(14) < 9, 40_000
    cov = np.linalg.inv(J[fitted].T @ J[fitted] + np.eye(6))
    found = told(J, fitted * 1.0, cov, ~fitted)
    # By eigenvalues of the data's information in the prior's measure.
    values = np.linalg.eigvalsh(J[fitted].T @ J[fitted])
    np.testing.assert_allclose(found.by_data, np.sum(values / (1.0 + values)), rtol=1e-12)
    assert found.by_data < 5.0
    x = rng.normal(size=(draws, 6))
    y = x @ J.T + rng.normal(size=(draws, 14))
    error = y[:, fitted] @ (cov @ J[fitted].T).T - x
    left = y - (x + error) @ J.T
    inside = (left[:, fitted] ** 2).sum(axis=1)
    own = ((error @ J[fitted].T) ** 2).sum(axis=1)
    ahead = (left[:, ~fitted] ** 2).mean(axis=1)
    for sample, expected in ((inside, 9 - found.by_data), (own, found.by_data), (ahead, found.missed**2)):
        np.testing.assert_allclose(sample.mean(), expected, atol=4.0 * sample.std() / np.sqrt(draws))
    # Agreement says nothing of the error: no correlation beyond that of as many independent draws.
    wrong = (error**2).sum(axis=1)
    assert abs(np.corrcoef(inside, wrong)[0, 1]) < 4.0 / np.sqrt(draws)


def test_what_nothing_tells_and_what_is_asked_wrongly():
    J = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    cov = np.diag([0.5, np.inf])
    cov[0, 1] = cov[1, 0] = 0.0
    later = np.array([False, False, True])
    assert told(J, (~later).astype(float), cov, later).ahead == np.inf
    assert told(J, (~later).astype(float), cov, np.zeros(3, bool)).ahead == 0.0
    with pytest.raises(ValueError, match="both fitted and predicted"):
        told(J, np.ones(3), cov, later)
