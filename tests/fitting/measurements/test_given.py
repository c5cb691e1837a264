"""A given motion: its rates against closed forms, and nothing across its gaps."""

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.given import is_told, motion_at, stretches

SPIN = np.array([0.01, -0.02, 0.03])
ACCELERATION = np.array([2e-4, 1e-4, -1e-4])
START = Rotation.from_rotvec([1.0, 2.0, 0.5])


def steady(t):
    """Inertial from body, turning by `SPIN` in body axes."""
    return START * Rotation.from_rotvec(np.outer(t, SPIN))


def given(t, turns):
    return t, turns.as_quat(scalar_first=True)


def test_rates_are_those_in_body_axes():
    t, at = np.arange(0.0, 100.0, 5.0), np.array([3.3, 41.0, 94.9])
    motion = motion_at(given(t, steady(t)), at)
    apart = steady(at).inv() * Rotation.from_quat(motion.quaternion, scalar_first=True)
    np.testing.assert_allclose(apart.magnitude(), 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.angular_velocity, np.tile(SPIN, (3, 1)), atol=1e-9)
    np.testing.assert_allclose(motion.acceleration, 0.0, atol=1e-9)


def test_rates_are_the_slopes_of_the_attitude():
    t = np.arange(0.0, 60.0, 4.0)
    turns = START * Rotation.from_rotvec(np.outer(t, SPIN) + 0.5 * np.outer(t**2, ACCELERATION))
    at, h = np.array([10.0, 33.0]), 1e-3
    before, here, after = (motion_at(given(t, turns), at + shift) for shift in (-h, 0.0, h))
    first, last = (Rotation.from_quat(each.quaternion, scalar_first=True) for each in (before, after))
    middle = Rotation.from_quat(here.quaternion, scalar_first=True)
    # A step on both sides of the middle, seen from there.
    rate = ((middle.inv() * last).as_rotvec() - (middle.inv() * first).as_rotvec()) / (2.0 * h)
    np.testing.assert_allclose(here.angular_velocity, rate, atol=1e-7)
    slope = (after.angular_velocity - before.angular_velocity) / (2.0 * h)
    np.testing.assert_allclose(here.acceleration, slope, atol=1e-6)


def test_nothing_is_told_across_a_gap_nor_by_a_quaternion_alone():
    t = np.concatenate([np.arange(0.0, 50.0, 10.0), [500.0], np.arange(900.0, 950.0, 10.0)])
    assert [(part.start, part.stop) for part in stretches(t)] == [(0, 5), (6, 11)]
    at = np.array([-1.0, 0.0, 35.0, 40.0, 41.0, 500.0, 899.0, 925.0, 941.0])
    assert is_told(given(t, steady(t)), at).tolist() == [False, True, True, True, False, False, False, True, False]
    # A turn over the gap, which a curve through all would feel before it.
    jumped = Rotation.concatenate([steady(t[:6]), Rotation.from_rotvec([0.0, 0.0, 2.0]) * steady(t[6:])])
    motion = motion_at(given(t, jumped), np.array([35.0, 925.0]))
    np.testing.assert_allclose(motion.angular_velocity, np.tile(SPIN, (2, 1)), atol=1e-9)
