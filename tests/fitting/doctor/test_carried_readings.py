"""Readings of a channel carried to the instants that its stamps say, between stamps of other channels."""

import numpy as np

from fitting.doctor.causes.stamps import _carried


def wave(t):
    return np.column_stack([np.sin(0.05 * t), np.cos(0.03 * t)])


def test_stamps_of_other_channels_between_do_not_matter():
    own, others = np.arange(0.0, 200.0, 4.0) + 1.3, np.arange(0.0, 200.0, 4.0)
    t = np.sort(np.concatenate([own, others]))
    rows = np.where(np.isin(t, own)[:, None], wave(t), np.nan)
    carried = _carried(t, rows, 5.0)
    known = np.isfinite(carried).all(axis=1)
    # All but the last two, whose instants lie after the last reading.
    np.testing.assert_array_equal(t[known], own[:-2])
    np.testing.assert_allclose(carried[known], wave(t[known] + 5.0), atol=1e-4)


def test_nothing_is_carried_across_a_gap():
    t = np.concatenate([np.arange(0.0, 60.0, 4.0), np.arange(100.0, 160.0, 4.0)])
    carried = _carried(t, wave(t), -6.0)
    gone = np.isin(t, [0.0, 4.0, 100.0, 104.0])
    np.testing.assert_array_equal(np.isnan(carried).any(axis=1), gone)
