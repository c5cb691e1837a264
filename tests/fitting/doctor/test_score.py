"""What a look promises for more numbers, against least squares of a linear problem solved both ways."""

import numpy as np

from fitting.doctor.score import SCALE, Score

RNG = np.random.default_rng(4)
J, C, R = RNG.normal(size=(40, 2, 3)), RNG.normal(size=(40, 2, 2)), 1e-3 * RNG.normal(size=(40, 2))
NOTHING = np.full((40, 2), -np.inf)


def test_more_numbers_save_what_least_squares_says():
    weight = (RNG.random((40, 2)) < 0.8).astype(float)
    x, has_prior = np.array([0.0, 0.2, -0.1]), np.array([False, True, True])
    # Small residuals: large ones count less.
    sizes, fall = Score(R, J, weight, NOTHING, x, has_prior).fall(C, with_prior=True)
    w, r = weight.reshape(-1), R.reshape(-1)

    def least(columns, priors, start):
        A = np.concatenate([w[:, None] * columns.reshape(80, -1), np.diag(priors)])
        b = np.concatenate([w * r, priors * start])
        step = np.linalg.lstsq(A, -b, rcond=None)[0]
        return step, float(((b + A @ step) ** 2).sum())

    alone = least(J, has_prior.astype(float), x)
    both = least(np.concatenate([J, C], axis=-1), np.array([0.0, 1.0, 1.0, 1.0, 1.0]), np.array([*x, 0.0, 0.0]))
    np.testing.assert_allclose(sizes, both[0][3:], rtol=1e-5)
    assert np.isclose(fall, alone[1] - both[1], rtol=1e-5)


def test_a_reading_far_off_promises_little():
    residual = R.copy()
    residual[3, 0] = 100.0
    score = Score(residual, J, np.ones((40, 2)), NOTHING, np.zeros(3), np.zeros(3, bool))
    column = np.zeros((40, 2, 1))
    column[3, 0] = 1.0
    _, fall = score.fall(column, with_prior=False)
    # Of the square a robust loss leaves its root, times the scale.
    assert fall < 1.2 * SCALE * 100.0
