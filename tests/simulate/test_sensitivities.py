"""`Sensitivities` of a sphere that nothing turns, whose motion is known; what it refuses."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.simulate import Sensitivities
from jaxsat.spacecraft import HysteresisRods, Spacecraft

HERE = np.array([1.0, 0.0, 0.0, 0.0])
TIMES = np.array([60.0, 150.0])


def around(times):
    return OrbitTable(jnp.full((*times.shape, 3), 4e6), jnp.full((*times.shape, 3), 2e-5))


def sphere(x):
    """Unknowns are the rate about z and the moment of inertia."""
    return Spacecraft(x[1] * jnp.eye(3)), AttitudeState(jnp.asarray(HERE), jnp.stack([0.0 * x[0], 0.0 * x[0], x[0]]))


@pytest.mark.slow
def test_steps_are_found_anew_for_a_faster_motion():
    """q = (cos wt/2, 0, 0, sin wt/2), to the tolerance, also at thirty times the rate that the steps were found for."""
    ways = Sensitivities(sphere, around, TIMES, torques=(), tolerance=1e-7)
    for rate in (0.004, 0.12):
        found = ways(np.array([rate, 0.05]))
        half, by_rate = 0.5 * rate * TIMES, 0.5 * TIMES
        np.testing.assert_allclose(found.motion.quaternion[:, [0, 3]].T, [np.cos(half), np.sin(half)], atol=1e-7)
        expected = np.stack([-np.sin(half) * by_rate, np.cos(half) * by_rate])
        np.testing.assert_allclose(found.quaternion[:, [0, 3], 0].T, expected, atol=1e-5)
        assert found.quaternion.shape == (2, 4, 2)
        assert np.all(found.quaternion[..., 1] == 0.0)


@pytest.mark.parametrize(
    ("unknowns", "words"),
    [
        (np.zeros((2, 2, 2)), r"\[n\] or \[cases, n\]"),
        (np.array([0.1, -0.05]), "case 0: spacecraft.inertia"),
        (np.array([np.nan, 0.05]), "case 0: the initial state is not finite"),
    ],
)
def test_unknowns_that_make_no_satellite(unknowns, words):
    with pytest.raises(ValueError, match=words):
        Sensitivities(sphere, around, TIMES, torques=(), max_step=10.0)(unknowns)


def test_rods_with_hysteresis_have_kinks():
    one = np.ones(1)
    rods = HysteresisRods(np.eye(3)[:1], one * 1e-6, one * 12.0, one * 0.004, one * 0.025)

    def lagging(x):
        return Spacecraft(x[0] * jnp.eye(3), hysteresis_rods=rods), AttitudeState(HERE, np.zeros(3), jnp.zeros(1))

    with pytest.raises(ValueError, match="kinks"):
        Sensitivities(lagging, around, TIMES, max_step=10.0)(one)
