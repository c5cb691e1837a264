"""How far an axis is off the field, and the error that it makes, against least squares of linear residuals."""

import numpy as np
import pytest

from fitting.local.off_axis import axis_off, roll_sigma

RNG = np.random.default_rng(5)
AXIS = np.array([0.6, 0.0, 0.8])
ACROSS = np.array([[0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]).T
COUNT, NOISE = 4000, 2e-3


def solved(off: float, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squares that are left, and errors of the attitude [n 3]: two factors are linear unknowns beside the roll."""
    factors = RNG.normal(size=(6, 2))
    turn = ACROSS @ RNG.normal(scale=off, size=(2, COUNT))
    measured = slopes @ turn + RNG.normal(scale=NOISE, size=(6, COUNT))
    unknowns = np.column_stack([slopes @ AXIS, factors])
    found = np.linalg.lstsq(unknowns, measured, rcond=None)[0]
    return np.sum((measured - unknowns @ found) ** 2, axis=0), (np.outer(AXIS, found[0]) - turn).T


def across_factors(slopes: np.ndarray, state) -> np.ndarray:
    RNG.bit_generator.state = state
    factors = RNG.normal(size=(6, 2))
    return slopes - factors @ np.linalg.lstsq(factors, slopes, rcond=None)[0]


@pytest.mark.parametrize("off", [0.0, 0.2])
def test_the_residuals_tell_how_far_the_axis_is_off(off):
    slopes = RNG.normal(scale=0.1, size=(6, 3))
    state = RNG.bit_generator.state
    squares, errors = solved(off, slopes)
    projected = np.broadcast_to(across_factors(slopes, state), (COUNT, 6, 3))
    told = axis_off(projected, squares, AXIS, NOISE)
    # Of 8000 angles: 1 % at 1 sigma; what noise alone leaves is 3 % of 2 mA over slopes of 0.1 A.
    assert told == pytest.approx(off, rel=0.05, abs=0.005)
    # Largest eigenvalue of the scatter of 4000 errors: 2.2 % of a sigma is its own 2 sigma.
    spread = np.sqrt(np.linalg.eigvalsh(errors.T @ errors / COUNT)[-1])
    sigma = roll_sigma(projected[:2], AXIS, NOISE, off, np.array([True, False]))
    assert sigma[0] == pytest.approx(spread, rel=0.04) and np.isinf(sigma[1])


def test_no_samples_tell_nothing():
    assert axis_off(np.zeros((0, 6, 3)), np.zeros(0), AXIS, NOISE) == 0.0
