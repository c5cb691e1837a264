"""Motion between samples against the closed form of a free symmetric top."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from jaxsat.math.attitude_between import MOST_NODES, attitude_between

TURN = np.radians(6.0)


def top(t: np.ndarray, spin: float, across: float = 0.004) -> tuple[np.ndarray, np.ndarray]:
    """Attitudes and rates of a top with moments A, A, C = 0.8 A: w turns about the axis at (C - A)/A times its spin.

    In inertial axes it precesses about the fixed momentum at |L|/A while it turns about its own axis at (1 - C/A) spin.
    """
    slip = (0.8 - 1.0) * spin
    rate = np.stack([across * np.cos(slip * t), across * np.sin(slip * t), np.full_like(t, spin)], axis=1)
    momentum = np.array([across, 0.0, 0.8 * spin])
    precession = Rotation.from_rotvec(t[:, None] * momentum)
    own = Rotation.from_rotvec(-t[:, None] * np.array([0.0, 0.0, slip]))
    return np.roll((precession * own).as_quat(), 1, axis=1), rate


def error_deg(t: np.ndarray, q: np.ndarray, spin: float) -> np.ndarray:
    overlap = np.abs(np.sum(q * top(t, spin)[0], axis=1))
    return np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0)))


# The last turns by 275 deg from sample to sample, which great arcs take the short way round.
@pytest.mark.parametrize(("spin", "limit_deg"), [(0.0105, 0.05), (0.03, 0.3), (0.075, 1.5)])
def test_nodes_lie_on_the_motion(spin, limit_deg):
    t = np.array([0.0, 64.0, 128.0, 192.0, 320.0, 384.0, 448.0])
    q, rate = top(t, spin)
    nodes, attitudes = attitude_between(t, q, rate, largest_turn=TURN)
    assert error_deg(nodes, attitudes, spin).max() < limit_deg
    assert np.all(np.diff(nodes) > 0.0) and set(t) <= set(nodes)
    turns = 2.0 * np.arccos(np.minimum(np.abs(np.sum(attitudes[1:] * attitudes[:-1], axis=1)), 1.0))
    assert turns.max() < 1.1 * TURN
    arcs = Slerp(t, Rotation.from_quat(np.roll(q, -1, axis=1)))(nodes)
    assert error_deg(nodes, np.roll(arcs.as_quat(), 1, axis=1), spin).max() > 4.0 * limit_deg


def test_samples_are_kept_even_where_rates_disagree():
    rng = np.random.default_rng(1)
    q = rng.normal(size=(5, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    t = 64.0 * np.arange(5)
    nodes, attitudes = attitude_between(t, q, rng.normal(scale=0.02, size=(5, 3)), largest_turn=TURN)
    at = np.searchsorted(nodes, t)
    np.testing.assert_allclose(np.abs(np.sum(attitudes[at] * q, axis=1)), 1.0, atol=1e-12)


def test_long_sessions_stay_small_and_short_ones_work():
    t = 10.0 * np.arange(15000)
    q, rate = top(t, 0.03)
    assert len(attitude_between(t, q, rate, largest_turn=TURN)[0]) <= MOST_NODES + 1
    nodes, attitudes = attitude_between(t[:1], q[:1], rate[:1], largest_turn=TURN)
    assert nodes.tolist() == [0.0] and attitudes.shape == (1, 4)
