"""Breaks by turns that are not small, and several of them; what they leave."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.outcome.breaks import find_breaks

COUNT, SIGMA = 600, 0.3
T = np.arange(COUNT) * 10.0
# A field in its orbit, uT.
VECTOR = np.stack([25.0 * np.sin(T / 890.0), 12.0 * np.cos(T / 640.0), 30.0 * np.cos(T / 890.0)], axis=1)


def found_in(measured, sigma=SIGMA):
    return find_breaks(T, (measured - VECTOR) / sigma, VECTOR, sigma, 1.0)


def noise(seed):
    return np.random.default_rng(seed).normal(scale=SIGMA, size=VECTOR.shape)


@pytest.mark.parametrize("turn_deg", [0.0, 3.0, 12.0, 40.0])
def test_a_turn_and_a_bias_are_found_whole(turn_deg):
    axis = np.array([0.6, -0.64, 0.48])
    bias, first = np.array([1.0, -2.0, 0.5]), 371
    measured = VECTOR + noise(1)
    measured[first:] += Rotation.from_rotvec(np.radians(turn_deg) * axis).apply(VECTOR[first:]) + bias - VECTOR[first:]
    (found,) = found_in(measured)
    assert found.t_s == pytest.approx(T[first], abs=15.0)
    assert found.turn_deg == pytest.approx(turn_deg, abs=0.3)
    assert found.bias == pytest.approx(np.linalg.norm(bias), abs=0.15)
    # What is left is the noise, also where the turn is no small one.
    np.testing.assert_allclose(found.left, SIGMA, rtol=0.12)


def test_two_breaks_are_told_one_after_the_other():
    measured = VECTOR + noise(2)
    measured[200:] += [0.0, 0.0, 3.0]
    measured[450:] += [-2.0, 0.0, 0.0]
    first, second = found_in(measured)
    assert (first.t_s, second.t_s) == pytest.approx((T[200], T[450]), abs=15.0)
    # The first one takes on some of the second, until that is told too.
    np.testing.assert_allclose(second.left, SIGMA, rtol=0.12)
    assert max(first.left) > 1.3 * SIGMA
