"""The attitude filter in a loop: it waits for the Sun, finds attitude and bias, and pointing waits for it."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.control.loops import AsRead, Estimate, Filtered, Instant, Motion, Now, Pointing, channel
from jaxsat.control.loops.readings import nothing_yet, read
from jaxsat.estimation.attitude_filter import AttitudeFilter
from jaxsat.estimation.gyro_errors import GyroErrors
from jaxsat.sensors import Gyroscope, Magnetometer, SunVector

RATE, BIAS = np.array([0.01, -0.02, 0.015]), np.array([1e-3, -5e-4, 2e-3])
FIELD, SUN = np.array([2e-5, -1e-5, 3e-5]), np.array([0.6, 0.0, 0.8])
GYRO, FIELD_SIGMA, SUN_SIGMA, PERIODS, DARK = 1e-4, 3e-3, 2e-3, 300, 20
CHANNELS = {
    "field": channel(Magnetometer(), sigma=FIELD_SIGMA * float(np.linalg.norm(FIELD))),
    "rate": eqx.tree_at(lambda c: c.sensor.bias, channel(Gyroscope(), sigma=GYRO), jnp.asarray(BIAS)),
    "sun": channel(SunVector(), sigma=SUN_SIGMA),
}
FILTER = Filtered(AttitudeFilter(GyroErrors(GYRO, 1e-8)), field_sigma=FIELD_SIGMA, sun_sigma=SUN_SIGMA, bias_sigma=5e-3)
HERE = Instant(
    *(jnp.asarray(x, float) for x in (0.0, [7e6, 0, 0], [0, 7500.0, 0], FIELD, SUN, 1.0)), mode=jnp.asarray(0)
)


@pytest.fixture(scope="module")
def run():
    """Attitudes, and estimates each second; dark at first."""
    begin = Rotation.from_rotvec([0.3, -0.8, 0.5])
    q = np.array([(begin * Rotation.from_rotvec(RATE * k)).as_quat(scalar_first=True) for k in range(PERIODS)])
    random = jax.random.normal(jax.random.key(3), (PERIODS, 12))

    def step(carry, given):
        late, memory = carry
        q, random, lit = given
        here = dataclasses.replace(HERE, illumination=lit)
        motion = Motion(q, jnp.asarray(RATE))
        late, readings = read(CHANNELS, late, motion, here, random.at[9:].set(0.5))
        memory, estimate = FILTER.update(memory, readings, Now(here, jnp.asarray(1.0), motion))
        return (late, memory), estimate

    lit = (jnp.arange(PERIODS) >= DARK).astype(float)
    first = (nothing_yet(CHANNELS), FILTER.start())
    _, estimates = jax.jit(lambda q: jax.lax.scan(step, first, (q, random, lit)))(jnp.asarray(q))
    return q, jax.device_get(estimates)


def test_it_begins_with_the_sun_and_finds_attitude_and_bias(run):
    q, estimates = run
    np.testing.assert_array_equal(estimates.attitude_known, np.arange(PERIODS) >= DARK)
    true = Rotation.from_quat(q[DARK:], scalar_first=True)
    off = (true.inv() * Rotation.from_quat(estimates.quaternion[DARK:], scalar_first=True)).magnitude()
    # Two directions half a radian apart and more, one reading of each at first; then hundreds with the gyro.
    assert off[0] < 5.0 * FIELD_SIGMA / np.sin(0.5) and off[-50:].max() < 2.0 * FIELD_SIGMA
    found = np.mean(estimates.angular_velocity[-50:], axis=0)
    np.testing.assert_allclose(found, RATE, rtol=0, atol=5.0 * GYRO)
    assert np.linalg.norm(BIAS) > 20.0 * GYRO


def test_pointing_waits_until_the_attitude_is_known():
    law = Pointing(0.03 * np.eye(3), 0.1, 0.8, 0.01, 0.0, 0.2, 0.0, None)
    q = jnp.array([0.8, 0.6, 0.0, 0.0])
    here = dataclasses.replace(HERE, target_quaternion=jnp.array([1.0, 0, 0, 0]), target_rate_eci=jnp.zeros(3))
    now = Now(here, jnp.asarray(1.0), Motion(q, jnp.zeros(3)))
    for known in (False, True):
        told = Estimate(jnp.asarray(FIELD), jnp.asarray(True), jnp.zeros(3), q, jnp.asarray(known))
        _, commands = law.update(None, told, now)
        assert bool(np.any(commands.dipole)) == known
        _, commands = dataclasses.replace(law, by_thrusters=True).update(None, told, now)
        # 74 deg about x, by J times -2 f^2 q of what a slew is limited to.
        np.testing.assert_allclose(
            np.asarray(commands.thrust), [-0.03 * 0.02 * 0.08 if known else 0.0, 0.0, 0.0], atol=1e-18
        )
        assert not np.any(commands.dipole)


def test_what_it_needs_is_named():
    with pytest.raises(ValueError, match="Filtered needs the reading 'field'"):
        FILTER.update(FILTER.start(), {}, Now(HERE, jnp.asarray(1.0), Motion(jnp.zeros(4), jnp.zeros(3))))
    assert AsRead().start() is None
