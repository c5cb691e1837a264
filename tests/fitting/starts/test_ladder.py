"""First guesses from what sensors see, and conventions of axes, against SciPy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.starts.ladder import finite_turn_rates, first_guesses, telling_samples
from fitting.starts.sights import Directions, Sights
from jaxsat.sensors.mounting import axes_text, signed_permutations

RATE = np.radians([3.0, -6.0, 2.0])
T = np.arange(40) * 2.0


def sights(*, directions=2, gyro=False, first=0):
    """A body that turns at a constant rate, with one or two known directions in sight from sample `first` on."""
    start = Rotation.from_euler("xyz", [20.0, -50.0, 110.0], degrees=True)
    attitude = start * Rotation.from_rotvec(T[:, None] * RATE)
    known = [np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])][:directions]
    seen = []
    for vector in known:
        body = attitude.inv().apply(vector)
        body[:first] = np.nan
        seen.append(Directions(body, np.tile(vector, (len(T), 1)), np.full(len(T), 0.01)))
    rate = np.tile(RATE, (len(T), 1)) if gyro else np.full((len(T), 3), np.nan)
    none = np.full((len(T), 4), np.nan)
    return Sights(T, tuple(seen), none, rate, np.full(len(T), 1e-3)), attitude


def error_deg(quaternion, attitude):
    return np.degrees((Rotation.from_quat(quaternion, scalar_first=True).inv() * attitude).magnitude())


def test_two_directions_give_attitude_and_rate():
    seen, attitude = sights()
    found = first_guesses(seen, 0, 32, 1.0, np.random.default_rng(0))
    assert error_deg(found.attitude[0], attitude[0]) < 1e-6
    np.testing.assert_allclose(found.rate[0], RATE, atol=1e-9)
    np.testing.assert_allclose(finite_turn_rates(T, seen.wahba()[0]), np.tile(RATE, (len(T) - 1, 1)), atol=1e-9)


def test_attitudes_seen_later_are_carried_back():
    seen, attitude = sights(first=5)
    assert telling_samples(seen)[0] == 5
    found = first_guesses(seen, 0, 32, 1.0, np.random.default_rng(0))
    assert error_deg(found.attitude[0], attitude[0]) < 1e-6


@pytest.mark.parametrize("gyro", [False, True])
def test_one_direction_leaves_the_roll_open(gyro):
    seen, attitude = sights(directions=1, gyro=gyro)
    found = first_guesses(seen, 0, 64, 0.2, np.random.default_rng(1))
    in_place = Rotation.from_quat(found.attitude, scalar_first=True).apply(seen.directions[0].body[0])
    np.testing.assert_allclose(in_place, np.tile(seen.directions[0].inertial[0], (64, 1)), atol=1e-9)
    # Of 64 rolls, one in each 64th of a turn, some are within two strata of the true one.
    assert error_deg(found.attitude, attitude[0]).min() < 2.0 * 360.0 / 64.0
    sizes = np.linalg.norm(found.rate, axis=1)
    if gyro:
        assert np.linalg.norm(found.rate - RATE, axis=1).max() < np.radians(1.5)
    else:
        # Even in the ball: half of its volume lies beyond 0.794 of the radius.
        assert sizes.max() <= 0.2 and 0.4 < np.mean(sizes > 0.794 * 0.2) < 0.6


def test_conventions_are_24_right_handed_and_as_many_mirrored():
    right, both = signed_permutations(False), signed_permutations(True)
    assert len({m.tobytes() for m in both}) == 48 and len(right) == 24
    assert all(np.isclose(np.linalg.det(m), 1.0) and np.allclose(m @ m.T, np.eye(3)) for m in right)
    assert axes_text(np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])) == ["-z", "+x", "-y"]
