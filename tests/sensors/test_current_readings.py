"""Limited, noisy and rounded currents: each disturbance by what it must do."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.sensors import current_readings as readings
from jaxsat.sensors.current_readings import limited_currents as limited
from jaxsat.sensors.current_readings import uniform_noise

limited_currents = jax.jit(limited)
current_readings = jax.jit(readings, static_argnames=("quantum", "draw"))
KEY = jax.random.key(3)
CURRENTS = jnp.array([[100.0, 0.0, 150.0, 0.0, 0.0, 50.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
ONE = jnp.ones(3)


def test_limits_act_in_turn():
    factors = jnp.array([0.5, 1.0, 0.2])
    np.testing.assert_allclose(limited_currents(CURRENTS, factors)[0], [50, 0, 150, 0, 0, 10])
    np.testing.assert_allclose(limited_currents(CURRENTS, ONE, panel_limit=80.0)[0], [80, 0, 80, 0, 0, 50])
    lowered = limited_currents(CURRENTS, factors, panel_limit=140.0, sum_limit=100.0)
    np.testing.assert_allclose(lowered[0], np.array([50, 0, 140, 0, 0, 10]) / 2)
    assert not np.any(lowered[1])
    np.testing.assert_array_equal(limited_currents(CURRENTS, ONE), CURRENTS)


def test_the_gradient_of_a_dark_sample_is_finite():
    slope = jax.jit(jax.jacfwd(lambda c: limited_currents(c, ONE, sum_limit=100.0)))(CURRENTS)
    assert np.all(np.isfinite(slope))


@pytest.mark.parametrize(("draw", "largest"), [(jax.random.normal, 6.0), (uniform_noise, np.sqrt(3.0))])
def test_noise_has_its_sigma(draw, largest):
    lit = jnp.full((20000, 6), 100.0)
    error = np.asarray(current_readings(lit, sigma=2.0, offset=5.0, quantum=0.0, draw=draw, key=KEY)) - 105.0
    # 120000 numbers: sigma to 0.3 %, mean to 0.006.
    assert np.std(error) == pytest.approx(2.0, rel=0.01) and abs(np.mean(error)) < 0.03
    assert np.max(np.abs(error)) < 2.0 * largest


def test_readings_are_whole_steps_from_zero_up():
    found = current_readings(jnp.full((500, 6), 1.0), sigma=2.0, offset=0.0, quantum=0.5, key=KEY)
    assert np.all(np.asarray(found) % 0.5 == 0.0) and np.min(np.asarray(found)) == 0.0
    dark = current_readings(CURRENTS, sigma=2.0, offset=0.0, quantum=1.0, key=KEY)[1]
    assert not np.any(dark)
    shifted = current_readings(CURRENTS, sigma=2.0, offset=4.0, quantum=1.0, key=KEY)[1]
    np.testing.assert_array_equal(shifted, 4.0)
