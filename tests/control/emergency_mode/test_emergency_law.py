"""Laws (2) and (3) of Somov 2018 by what they do to a turn, a steady and a steadily growing error."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.control.emergency_mode.law import LARGEST, EmergencyLaw, wanted_torque

J = np.diag([11450.0, 7150.0, 9450.0])
LAW = EmergencyLaw(5e-7, 3e-3, 4e-7, 2e-3, 0.7)
PERIOD = 16.0
torque_of = jax.jit(wanted_torque)


def torque(error, rate=(0.0, 0.0, 0.0), memory=(0.0, 0.0, 0.0), law=LAW):
    given = (jnp.asarray(np.array(x, float)) for x in (J, error, rate, memory))
    return [np.asarray(x) for x in torque_of(law, *given, PERIOD)]


def test_far_off_it_is_eq_2():
    error, rate = np.array([0.3, -0.1, 0.2]), np.array([1e-5, 2e-5, -1e-5])
    found, _ = torque(error, rate)
    np.testing.assert_allclose(found, -J @ (5e-7 * error + 3e-3 * rate), rtol=1e-12)
    # A quarter turn about one axis is the limit; beyond it all components shrink alike.
    assert pytest.approx(4.0 * np.tan(np.pi / 8.0)) == LARGEST == pytest.approx(1.656854, abs=1e-6)
    found, _ = torque(2.0 * np.array([LARGEST, 0.5, -0.3]))
    np.testing.assert_allclose(np.linalg.solve(J, found), -5e-7 * np.array([LARGEST, 0.5, -0.3]), rtol=1e-12)


def run(errors, pole):
    law = EmergencyLaw(5e-7, 3e-3, 4e-7, 2e-3, pole)
    memory, found = np.zeros(3), []
    for error in errors:
        given, memory = torque(error, memory=memory, law=law)
        found.append(np.linalg.solve(J, given))
    return np.array(found)


@pytest.mark.parametrize("pole", [0.3, 0.7, 0.9])
def test_near_it_is_eq_3(pole):
    """No rate is read: a steady error meets the stiffness, a growing one the damping as well."""
    angle = np.array([0.01, -0.005, 0.002])
    steady = run([angle] * 200, pole)
    np.testing.assert_allclose(steady[-1], -4e-7 * angle, rtol=1e-6)
    # From rest the first reaction is stronger: that is the lead.
    assert np.all(np.abs(steady[0]) > np.abs(steady[-1]))
    rate = np.array([1e-6, -2e-6, 1e-6])
    errors = [PERIOD * k * rate for k in range(200)]
    np.testing.assert_allclose(run(errors, pole)[-1], -(4e-7 * errors[-1] + 2e-3 * rate), rtol=1e-6)


def test_they_change_at_three_degrees():
    for size_deg, fine in ((2.99, True), (3.01, False)):
        error = np.radians(size_deg) * np.array([1.0, 0.0, 0.0])
        with_rate, _ = torque(error, rate=(1e-5, 0.0, 0.0))
        without, _ = torque(error)
        assert np.array_equal(with_rate, without) == fine


def test_slopes_against_differences():
    """By all gains, in both laws, with and without saturation."""

    def wanted(values, error, rate):
        law = EmergencyLaw(*values)
        found, memory = wanted_torque(law, jnp.asarray(J), error, rate, jnp.array([1e-8, 0.0, 2e-8]), PERIOD)
        return jnp.concatenate([found, 1e4 * memory])

    both = jax.jit(lambda *given: (wanted(*given), jax.jacfwd(wanted)(*given)))
    values = np.array([5e-7, 3e-3, 4e-7, 2e-3, 0.7])
    for error, rate in (([0.3, -0.1, 0.2], [1e-5] * 3), ([3.0, 0.2, 0.1], [1e-5] * 3), ([0.01, 0.0, 0.0], [0.0] * 3)):
        given = jnp.asarray(error), jnp.asarray(rate)
        _, slopes = both(jnp.asarray(values), *given)
        for k, size in enumerate(values):
            step = 1e-5 * size * np.eye(5)[k]
            ends = [np.asarray(both(jnp.asarray(values + way * step), *given)[0]) for way in (1, -1)]
            scale = np.abs(ends[0]).max() / size
            found = (ends[0] - ends[1]) / (2e-5 * size)
            np.testing.assert_allclose(np.asarray(slopes)[:, k], found, atol=1e-6 * scale)
