"""Merging of starts that have met, and the bookkeeping of many starts in chunks."""

import numpy as np

from fitting.starts.multi_start import Starts, distinct


def starts(*points):
    """Points of (cost, rotation angle about x [rad], sign of the quaternion, rate)."""
    reference = [sign * np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0]) for _, angle, sign, _ in points]
    x = np.zeros((len(points), 7))
    x[:, 3] = [rate for *_, rate in points]
    return Starts(x, np.array(reference), np.array([cost for cost, *_ in points], dtype=float))


def kept(*points):
    return distinct(starts(*points), attitude=0.02, rate=2e-3).tolist()


def test_a_quaternion_and_its_negative_are_one_attitude():
    assert kept((1.0, 0.5, 1, 0.1), (2.0, 0.5, -1, 0.1)) == [0]
    assert kept((2.0, 0.5, 1, 0.1), (1.0, 0.51, -1, 0.101)) == [1]


def test_points_differ_by_attitude_or_by_rate():
    assert kept((1.0, 0.5, 1, 0.1), (2.0, 0.53, 1, 0.1), (3.0, 0.5, 1, 0.103)) == [0, 1, 2]
    assert kept((1.0, 0.0, 1, 0.1), (2.0, 2 * np.pi - 0.01, 1, 0.1)) == [0]


def test_best_comes_first_and_failures_are_dropped():
    assert kept((3.0, 0.1, 1, 0), (np.nan, 0.2, 1, 0), (1.0, 0.3, 1, 0), (np.inf, 0.4, 1, 0), (2.0, 0.5, 1, 0)) == [
        2,
        4,
        0,
    ]
    assert kept((np.nan, 0.2, 1, 0)) == []


def test_what_is_near_a_merged_point_but_not_near_a_kept_one_stays():
    # 0.00 and 0.015 merge; 0.03 is near the one that is gone only.
    assert kept((1.0, 0.0, 1, 0), (2.0, 0.015, 1, 0), (3.0, 0.03, 1, 0)) == [0, 2]


def test_points_are_taken_in_the_order_asked_for():
    taken = starts((1.0, 0.1, 1, 0), (2.0, 0.2, 1, 0), (3.0, 0.3, 1, 0)).take(np.array([2, 0]))
    assert taken.cost.tolist() == [3.0, 1.0]
