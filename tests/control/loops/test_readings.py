"""Sensors of a loop: calibrated on board, late, lost, in the dark; and with the noise that is stated."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from jaxsat.control.loops import Instant, Motion, channel
from jaxsat.control.loops.readings import nothing_yet, numbers_needed, read
from jaxsat.sensors import Gyroscope, Magnetometer, StarTracker, SunVector

Q = Rotation.from_rotvec([0.3, -0.8, 0.5])
MOTION = Motion(jnp.asarray(Q.as_quat(scalar_first=True)), jnp.array([0.01, -0.02, 0.03]))
FIELD, SUN = np.array([2e-5, -1e-5, 3e-5]), np.array([0.6, 0.0, 0.8])
HERE = Instant(
    *(jnp.asarray(x, float) for x in (0.0, [7e6, 0, 0], [0, 7500.0, 0], FIELD, SUN, 1.0)), mode=jnp.asarray(0)
)
CHANNELS = {
    "field": channel(
        Magnetometer(
            bias=[1e-6, 2e-6, -1e-6],
            scale=[1.1, 0.9, 1.0],
            shear=[0.01, 0.0, 0.02],
            turn=[0.1, 0.2, -0.1],
            axes=[[0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]],
        ),
        sigma=1e-7,
    ),
    "rate": channel(Gyroscope(bias=[0.001, 0, 0], scale=[1.0, 1.02, 1.0], turn=[0, 0, 0.2])),
    "sun": channel(SunVector(turn=[0.0, 0.3, 0.0])),
    "attitude": channel(StarTracker(turn=[0.0, 0.0, 0.4], body_from_inertial=True)),
}
BLANK = nothing_yet(CHANNELS)


def test_on_board_all_are_in_body_axes():
    _, found = read(CHANNELS, BLANK, MOTION, HERE, None)
    np.testing.assert_allclose(found["field"].value, Q.inv().apply(FIELD), atol=1e-18)
    np.testing.assert_allclose(found["rate"].value, MOTION.angular_velocity, atol=1e-16)
    np.testing.assert_allclose(found["sun"].value, Q.inv().apply(SUN), atol=1e-14)
    turned = Rotation.from_quat(found["attitude"].value, scalar_first=True)
    assert (turned.inv() * Q).magnitude() < 1e-7 and all(one.fresh for one in found.values())


def test_a_bias_that_is_not_known_on_board_is_read():
    off = eqx.tree_at(lambda c: c["rate"].sensor.bias, CHANNELS, jnp.array([0.002, 0, 0]))
    _, found = read(off, BLANK, MOTION, HERE, None)
    extra = np.asarray(found["rate"].value - MOTION.angular_velocity)
    np.testing.assert_allclose(np.linalg.norm(extra), 0.001, rtol=1e-12)


def test_in_the_dark_the_last_direction_of_the_sun_stays():
    late, first = read(CHANNELS, BLANK, MOTION, HERE, None)
    dark = dataclasses.replace(HERE, illumination=jnp.asarray(0.1), sun_eci=jnp.array([1.0, 0, 0]))
    _, found = read(CHANNELS, late, MOTION, dark, None)
    assert not found["sun"].fresh and found["field"].fresh
    np.testing.assert_array_equal(found["sun"].value, first["sun"].value)


def test_readings_come_late_by_whole_periods_and_in_steps():
    channels = {"rate": channel(Gyroscope(), delay=2, quantum=0.004)}
    late, seen = nothing_yet(channels), []
    for rate in (0.011, 0.021, 0.031, 0.041):
        late, found = read(channels, late, Motion(MOTION.quaternion, jnp.array([rate, 0, 0])), HERE, None)
        seen.append((float(found["rate"].value[0]), bool(found["rate"].fresh)))
    assert [fresh for _, fresh in seen] == [False, False, True, True]
    np.testing.assert_allclose([value for value, _ in seen], [0.0, 0.0, 0.012, 0.020], atol=1e-15)


def test_drop_outs_and_noise_are_as_often_and_as_large_as_stated():
    channels = {
        "field": channel(Magnetometer(), sigma=2e-7, dropout=0.2),
        "rate": channel(Gyroscope(), sigma=1e-3, outliers=0.1),
    }
    cases = 20000
    assert numbers_needed(channels) == (6, 2)
    normal, uniform = jax.random.split(jax.random.key(1))
    numbers = jnp.concatenate([jax.random.normal(normal, (cases, 6)), jax.random.uniform(uniform, (cases, 2))], axis=1)
    blank = nothing_yet(channels)
    found = jax.jit(jax.vmap(lambda n: read(channels, blank, MOTION, HERE, n)[1]))(numbers)
    assert abs(float(jnp.mean(found["field"].fresh)) - 0.8) < 5.0 * 0.4 / np.sqrt(cases)
    off = np.asarray(found["field"].value)[np.asarray(found["field"].fresh)] - Q.inv().apply(FIELD)
    # Within five sigmas of a sample variance.
    np.testing.assert_allclose(np.mean(off**2, axis=0), 2e-7**2, rtol=5.0 * np.sqrt(2.0 / len(off)))
    # Beyond five sigmas are those with twenty times the noise that are beyond a quarter of theirs.
    rate = np.asarray(found["rate"].value - MOTION.angular_velocity[None])[:, 0]
    share = 0.2 * stats.norm.sf(0.25)
    assert abs(np.mean(np.abs(rate) > 5e-3) - share) < 5.0 * np.sqrt(share / cases)


def test_sensors_that_tell_no_loop_anything_are_refused():
    with pytest.raises(ValueError, match="all three components"):
        channel(Magnetometer(unit_vector=True))
    with pytest.raises(ValueError, match="do not span"):
        channel(Gyroscope(axes=[[1.0, 0, 0], [0, 1.0, 0]]))
