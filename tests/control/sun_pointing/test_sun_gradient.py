"""Derivatives of means over cases: against finite differences of the same cases, and by what must be."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.control.sun_pointing.cases import Cases
from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.control.sun_pointing.sensing import LoopSettings
from jaxsat.control.sun_pointing.sensitivity import _values, final_error, impulse, scaled, sensitivities, settling_time
from jaxsat.control.sun_pointing.vehicle import nominal_vehicle

SUN, LAW, SETTINGS, PERIODS = jnp.array([1.0, 0.0, 0.0]), SunPointingLaw(), LoopSettings(estimator="published"), 900
NAMES = ("slew_rate", "inertia", "rate_gain")
COUNT = 256


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(3)
    q, axis = rng.normal(size=(COUNT, 4)), rng.normal(size=(COUNT, 3))
    rate = np.radians(rng.uniform(size=(COUNT, 1))) * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    return Cases(jnp.asarray(q), jnp.asarray(rate), nominal_vehicle(), jax.random.split(jax.random.key(3), COUNT))


@pytest.mark.slow
def test_sensitivities_are_the_differences_of_means(cases):
    metrics = (settling_time, impulse, final_error(LAW, cases, SUN))
    found = sensitivities(SETTINGS, LAW, cases, SUN, PERIODS, NAMES, metrics, jax.random.key(1))
    # The same smooth mean at parameters a step apart: the spread stays, by other numbers.
    spread = 0.05 * np.random.default_rng(2).normal(size=(COUNT, len(NAMES)))

    def metric(shift):
        # The program of `sensitivities` itself, which scales and runs.
        return np.asarray(_values(SETTINGS, LAW, cases, SUN, PERIODS, NAMES, metrics, spread + shift))

    for k, name in enumerate(NAMES):
        h = 0.1 * np.eye(len(NAMES))[k]
        slope = (metric(h) - metric(-h)) / 0.2
        for n, each in enumerate(found):
            error = np.hypot(each.standard_error[k], slope[n].std(ddof=1) / np.sqrt(COUNT))
            assert each.gradient[k] == pytest.approx(slope[n].mean(), abs=4.0 * error), name
    time, spent, error = found
    # Of cases that hold the Sun, within the dead band, and of the few that do not yet.
    assert 0.0 < np.degrees(error.mean) < 5.0 and np.all(error.standard_error > 0.0)
    # A faster slew is over sooner and costs more; a heavier body costs in proportion.
    assert time.gradient[0] < -10.0 * time.standard_error[0] and spent.gradient[0] > 10.0 * spent.standard_error[0]
    assert spent.gradient[1] == pytest.approx(spent.mean, rel=0.15)


def test_scaling_moves_what_it_says_and_refuses_what_it_does_not_know(cases):
    names = ("inertia", "torque", "min_pulse", "hood_angle", "slew_rate")
    law, moved = scaled(LAW, cases, names, jnp.full((COUNT, 5), jnp.log(2.0)))
    old, new = cases.vehicle, moved.vehicle
    np.testing.assert_allclose(new.inertia[7], 2.0 * old.inertia)
    np.testing.assert_allclose(new.inverse_inertia[7] @ new.assumed_inertia[7], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(new.thrusters.torque[7], 2.0 * old.thrusters.torque)
    np.testing.assert_allclose(new.thrusters.min_pulse, 2.0 * old.thrusters.min_pulse)
    np.testing.assert_allclose(new.sensor.hood_angle, 2.0 * old.sensor.hood_angle)
    np.testing.assert_allclose(law.slew_rate, 2.0 * LAW.slew_rate)
    with pytest.raises(ValueError, match="no parameter 'mass'"):
        scaled(LAW, cases, ("mass",), jnp.zeros((COUNT, 1)))
