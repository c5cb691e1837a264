"""What becomes of a wish for torque: dead band, shortest pulse, limit, misalignment, impulse spent."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.control.actuators import Thrusters, fire

TORQUE, LEVER, SHORTEST = np.array([2.0, 4.0, 1.0]), 0.5, 0.05
THRUSTERS = Thrusters.along(np.eye(3), TORQUE, LEVER, SHORTEST)
NO_BAND = jnp.zeros(3)


@pytest.mark.parametrize("period", [0.5, 1.0])
def test_a_wish_within_the_limits_is_met_on_average(period):
    wanted = jnp.array([-1.0, 2.0, 0.5])
    pulses = fire(THRUSTERS, wanted, NO_BAND, period)
    np.testing.assert_allclose(pulses.torque_body, wanted, rtol=1e-15)
    # Each axis spends its angular impulse over the lever.
    assert float(pulses.impulse) == pytest.approx(3.5 * period / LEVER)
    assert float(pulses.count) == 3.0


def test_limit_shortest_pulse_and_dead_band():
    pulses = fire(THRUSTERS, jnp.array([9.0, -9.0, 0.0]), NO_BAND, 1.0)
    np.testing.assert_allclose(pulses.torque_body, [2.0, -4.0, 0.0])
    # 0.04 s of 2 N m is too short, 0.06 s is not.
    assert not np.any(fire(THRUSTERS, jnp.array([0.08, 0.0, 0.0]), NO_BAND, 1.0).torque_body)
    assert float(fire(THRUSTERS, jnp.array([0.12, 0.0, 0.0]), NO_BAND, 1.0).torque_body[0]) == pytest.approx(0.12)
    quiet = fire(THRUSTERS, jnp.array([0.5, -2.0, 0.5]), jnp.array([0.6, 1.0, 0.4]), 1.0)
    np.testing.assert_allclose(quiet.torque_body, [0.0, -2.0, 0.5])
    assert float(quiet.count) == 2.0


def test_a_misaligned_thruster_turns_about_its_own_axis():
    tilted = np.array([[np.cos(0.1), 0.0, 0.0], [np.sin(0.1), 1.0, 0.0], [0.0, 0.0, 1.0]])
    crooked = Thrusters(TORQUE, tilted, LEVER, SHORTEST, np.eye(3))
    pulses = fire(crooked, jnp.array([1.0, 0.0, 0.0]), NO_BAND, 1.0)
    np.testing.assert_allclose(pulses.torque_body, tilted[:, 0], rtol=1e-15)
