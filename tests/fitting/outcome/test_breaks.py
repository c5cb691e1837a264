"""Breaks and late stamps in residuals that are made by hand."""

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.outcome.breaks import find_breaks, stamp_delay

T = np.arange(400) * 5.0
FIELD = 30.0 * np.stack([np.cos(T / 300.0), np.sin(T / 170.0), np.sin(T / 410.0 + 1.0)], axis=1)
SIGMA = 0.3


def residual(seed=0):
    return np.random.default_rng(seed).normal(size=FIELD.shape)


def test_noise_has_no_break():
    found = [find_breaks(T, residual(seed), FIELD, SIGMA, 1.0) for seed in range(30)]
    assert not any(found)


def test_a_turn_and_a_bias_are_found_at_their_time():
    turn, bias, begin = np.radians([3.0, -8.0, 4.0]), np.array([0.5, 0.0, -1.0]), 250
    changed = residual(1)
    turned = Rotation.from_rotvec(turn).apply(FIELD[begin:])
    changed[begin:] += (turned - FIELD[begin:] + bias) / SIGMA
    (found,) = find_breaks(T, changed, FIELD, SIGMA, 1.0)
    assert abs(found.t_s - T[begin]) <= 15.0
    assert abs(found.turn_deg - np.degrees(np.linalg.norm(turn))) < 0.3
    assert abs(found.bias - np.linalg.norm(bias)) < 0.15


def test_late_stamps_show_in_residuals():
    late = 2.0
    rate = np.gradient(FIELD, T, axis=0)
    found = stamp_delay(T, residual() - late * rate / SIGMA, FIELD, SIGMA)
    assert found is not None
    delay, sigma = found
    assert abs(delay - late) < 3.0 * sigma and sigma < 0.3
    assert stamp_delay(T, residual(), np.ones_like(FIELD), SIGMA) is None
