"""Magnetometer, gyroscope, Sun vector and angles, horizon, limb, star tracker against SciPy's rotations."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sample_views import (
    ATTITUDES,
    CURRENTS,
    FACES,
    FIELDS,
    LIT,
    POSITIONS,
    RATES,
    SUNS,
    VIEWS,
    body,
    readings,
    slopes,
    some,
    told,
    view_of,
)
from scipy.spatial.transform import Rotation

from jaxsat.sensors import Gyroscope, HorizonVector, LimbSensor, Magnetometer, StarTracker, SunAngles, SunVector

TURN = np.array([0.3, -0.5, 0.2])
MOUNT = Rotation.from_rotvec(TURN)
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Mirrored: their determinant is -1."""
BIAS, SCALE, SHEAR = np.array([3e-6, -1e-6, 2e-6]), np.array([1.02, 0.97, 1.1]), np.array([0.01, -0.02, 0.03])
MATRIX = np.diag(SCALE) + np.array([[0.0, 0.03, -0.02], [0.03, 0.0, 0.01], [-0.02, 0.01, 0.0]])
STRAY = 1e-6 * np.random.default_rng(2).normal(size=(6, 3))
NADIR = -POSITIONS / np.linalg.norm(POSITIONS, axis=1, keepdims=True)


def in_sensor(vectors):
    return MOUNT.inv().apply(body(vectors))


def units(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def field():
    return in_sensor(FIELDS) @ MATRIX.T + BIAS


def by_faces():
    return (LIT[:, None] * np.maximum(body(SUNS) @ FACES.T, 0.0)) @ STRAY


def by_columns():
    return np.stack([CURRENTS["i2"], CURRENTS["i1"]], axis=1) @ STRAY[:2]


def sun_angles():
    x, y, z = (in_sensor(SUNS) @ AXES.T).T
    return np.stack([np.arctan2(x, z), np.arctan2(y, z)], axis=1)


def limb_angles():
    x, y, z = (in_sensor(NADIR) @ AXES.T).T
    return np.stack([np.arccos(x) - np.arcsin(6.4e6 / np.linalg.norm(POSITIONS, axis=1)), np.arctan2(z, y)], axis=1)


def star_attitudes():
    return (ATTITUDES * MOUNT).as_quat(scalar_first=True)


PLAIN = Magnetometer(BIAS, SCALE, SHEAR, TURN, AXES)
BY_FACES = Magnetometer(BIAS, SCALE, SHEAR, TURN, AXES, STRAY)
BY_COLUMNS = Magnetometer(BIAS, SCALE, SHEAR, TURN, AXES, STRAY[:2], stray_columns=("i2", "i1"))
DIRECTION = Magnetometer(BIAS, SCALE, SHEAR, TURN, AXES, STRAY, unit_vector=True)
TWO = Magnetometer(BIAS, SCALE, SHEAR, TURN, AXES[1:])
GYROSCOPE = Gyroscope(1e3 * BIAS, SCALE, TURN, AXES)
ANGLES, LIMB = SunAngles(TURN, AXES), LimbSensor(6.4e6, TURN, AXES)
SENSORS = {
    "field": (PLAIN, lambda: field() @ AXES.T),
    "field and faces": (BY_FACES, lambda: (field() + by_faces()) @ AXES.T),
    "field and columns": (BY_COLUMNS, lambda: (field() + by_columns()) @ AXES.T),
    "field direction": (DIRECTION, lambda: units(field() + by_faces()) @ AXES.T),
    "two of the field": (TWO, lambda: field() @ AXES[1:].T),
    "rate": (GYROSCOPE, lambda: (SCALE * MOUNT.inv().apply(RATES) + 1e3 * BIAS) @ AXES.T),
    "sun": (SunVector(TURN, AXES), lambda: in_sensor(SUNS) @ AXES.T),
    "sun angles": (ANGLES, sun_angles),
    "nadir": (HorizonVector(TURN, AXES), lambda: in_sensor(NADIR) @ AXES.T),
    "limb": (LIMB, limb_angles),
}


@pytest.mark.parametrize("name", SENSORS)
def test_reading_is_that_of_a_rotation_library(name):
    sensor, expected = SENSORS[name]
    np.testing.assert_allclose(readings(sensor), expected(), rtol=1e-12, atol=1e-14 * np.abs(expected()).max())


@pytest.mark.parametrize("inverse", [False, True], ids=["inertial from sensor", "sensor from inertial"])
def test_star_tracker_is_an_attitude_of_its_own_axes(inverse):
    found = Rotation.from_quat(readings(StarTracker(TURN, inverse)), scalar_first=True)
    expected = ATTITUDES * MOUNT
    assert ((expected.inv() if inverse else expected).inv() * found).magnitude().max() < 1e-14


@pytest.mark.parametrize(
    "name", ["field and faces", "field and columns", "field direction", "rate", "sun angles", "nadir", "limb", "star"]
)
def test_slopes_are_differences(name):
    """By every number of the sensor and by turns of the satellite, forward and reverse."""
    sensor = StarTracker(TURN) if name == "star" else SENSORS[name][0]
    check(*slopes(sensor, some(0, 7)))


def check(forward, reverse, differences):
    # Rounding of the reading over the step of 1e-6, and the step's square.
    np.testing.assert_allclose(forward, differences, atol=1e-9 * np.abs(forward).max())
    np.testing.assert_allclose(reverse, forward, atol=1e-12 * np.abs(forward).max())


@pytest.mark.parametrize("name", ["sun", "field"])
def test_without_a_turn_the_slopes_by_it_are_finite_and_right(name):
    sensor = eqx.tree_at(lambda s: s.turn, SENSORS[name][0], jnp.zeros(3))
    check(*slopes(sensor, some(3)))


def test_nadir_along_an_axis_and_sun_across_the_angles_axis_leave_finite_slopes():
    upright = Rotation.identity()
    for sensor, view in (
        (LimbSensor(), view_of(upright, position=(-7e6, 0.0, 0.0))),
        (LimbSensor(), view_of(upright, position=(7e6, 0.0, 0.0))),
        (HorizonVector(), view_of(upright, position=(-7e6, 0.0, 0.0))),
        # Along y, where the first angle has no meaning, and along z, where both are zero.
        (SunAngles(), view_of(upright, sun=(0.0, 1.0, 0.0))),
        (SunAngles(), view_of(upright, sun=(0.0, 0.0, 1.0))),
    ):
        forward, reverse, _ = slopes(sensor, jax.tree.map(lambda x: x[None], view))
        assert np.all(np.isfinite(sensor(view))) and np.all(np.isfinite(forward)) and np.all(np.isfinite(reverse))


def test_a_quaternion_differs_the_same_whatever_its_sign_and_length():
    small, sensor = np.array([2e-3, -1e-3, 3e-3]), StarTracker()
    for rotation in (ATTITUDES[0], ATTITUDES[5], Rotation.from_rotvec([np.pi, 0.0, 0.0])):
        reading = rotation.as_quat(scalar_first=True)
        modelled = jnp.asarray((rotation * Rotation.from_rotvec(small)).as_quat(scalar_first=True))
        for other in (reading, -reading, 3.0 * reading):
            found = sensor.difference(modelled, jnp.asarray(other))
            np.testing.assert_allclose(found, small, atol=1e-8)
            slope = jax.jacfwd(sensor.difference)(modelled, jnp.asarray(other))
            assert np.all(np.isfinite(slope))


def test_the_noise_of_an_attitude_is_a_turn_about_each_axis():
    sensor, reading = StarTracker(), jnp.asarray(ATTITUDES[2].as_quat(scalar_first=True))
    noisy = jax.vmap(lambda key: sensor.noisy(reading, 1e-3, key))(jax.random.split(jax.random.key(0), 4000))
    turned = (ATTITUDES[2].inv() * Rotation.from_quat(np.asarray(noisy), scalar_first=True)).as_rotvec()
    # Four sigmas of a sigma of 4000 draws.
    np.testing.assert_allclose(turned.std(axis=0), 1e-3, rtol=0.045)


def test_angles_differ_the_shorter_way():
    ahead, behind = jnp.asarray([3.1, -3.1]), jnp.asarray([-3.1, 3.1])
    expected = np.array([6.2 - 2.0 * np.pi, 2.0 * np.pi - 6.2])
    np.testing.assert_allclose(SunAngles().difference(ahead, behind), expected, atol=1e-12)
    np.testing.assert_allclose(LimbSensor().difference(ahead, behind), expected, atol=1e-12)
    np.testing.assert_array_equal(PLAIN.difference(jnp.ones(3), jnp.zeros(3)), 1.0)


@pytest.mark.parametrize(
    ("sensor", "expected"),
    [
        (PLAIN, units(body(FIELDS))),
        (eqx.tree_at(lambda s: (s.bias, s.stray), DIRECTION, (jnp.zeros(3), jnp.zeros((6, 3)))), units(body(FIELDS))),
        (GYROSCOPE, RATES),
        (SunVector(TURN, AXES), body(SUNS)),
        (HorizonVector(TURN, AXES), body(NADIR)),
    ],
    ids=["field", "field direction", "rate", "sun", "nadir"],
)
def test_a_reading_without_noise_tells_what_was_seen(sensor, expected):
    found, sigma = told(sensor, readings(sensor), 1e-9)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert np.all(sigma > 0.0) and np.all(sigma < 1e-4)
    spoilt = readings(sensor).copy()
    spoilt[3, 1] = np.nan
    found, sigma = told(sensor, spoilt, 1e-9)
    assert np.all(np.isnan(found[3])) and np.isnan(sigma[3]) and np.isfinite(np.delete(sigma, 3)).all()


def test_sun_angles_tell_the_sun_in_front():
    found, sigma = told(ANGLES, readings(ANGLES), 1e-3)
    ahead = in_sensor(SUNS) @ AXES[2] > 0.0
    np.testing.assert_allclose(found[ahead], body(SUNS)[ahead], atol=1e-12)
    np.testing.assert_array_equal(np.isfinite(sigma), ahead)
    assert LIMB.direct(readings(LIMB), 1e-3) is None and TWO.direct(readings(TWO), 1e-9) is None


@pytest.mark.parametrize("inverse", [False, True])
def test_a_star_tracker_tells_the_attitude(inverse):
    sensor = StarTracker(TURN, inverse)
    read = -2.0 * readings(sensor)
    read[4] = 0.0
    found, sigma = told(sensor, read, 1e-4)
    apart = (ATTITUDES[5:].inv() * Rotation.from_quat(found[5:], scalar_first=True)).magnitude()
    assert apart.max() < 1e-14
    assert np.isnan(sigma[4]) and np.isnan(found[4]).all() and sigma[5] == 1e-4


@pytest.mark.parametrize(
    ("sensor", "sigma", "truth"),
    [
        (PLAIN, 1e-6, units(body(FIELDS))),
        (eqx.tree_at(lambda s: (s.bias, s.stray), DIRECTION, (jnp.zeros(3), None)), 0.02, units(body(FIELDS))),
        (SunVector(TURN, AXES), 0.02, body(SUNS)),
        (HorizonVector(TURN, AXES), 0.02, body(NADIR)),
        (GYROSCOPE, 1e-3, RATES),
    ],
    ids=["field", "field direction", "sun", "nadir", "rate"],
)
def test_stated_errors_are_those_of_noise(sensor, sigma, truth):
    """Of the directions that noisy readings tell; a scale that is not one makes them a little too large."""
    keys = jax.random.split(jax.random.key(0), len(truth))
    noisy = jax.jit(jax.vmap(lambda view, key: sensor.noisy(sensor(view), sigma, key)))(VIEWS, keys)
    found, stated = told(sensor, np.asarray(noisy), sigma)
    freedom = 3.0 if sensor is GYROSCOPE else 2.0
    ratio = np.sqrt(np.mean(np.sum((found - truth) ** 2, axis=1) / stated**2) / freedom)
    # 120 or 180 numbers: 7 % of scatter.
    assert 0.75 < ratio < 1.2


def test_a_direction_widens_by_the_bias_it_hides_and_by_stray_fields():
    """What is in a field of unknown length is not known in angle; the error stays within three of the stated ones."""
    sensor = eqx.tree_at(lambda s: s.stray, DIRECTION, None)
    found, stated = told(sensor, readings(sensor), 1e-6)
    apart = np.arccos(np.sum(found * units(body(FIELDS)), axis=1))
    assert apart.max() < 3.0 * stated.max() and stated.max() < 0.2
    with_stray = told(DIRECTION, readings(DIRECTION), 1e-6)[1]
    assert np.all(with_stray > stated)
    assert np.all(told(BY_FACES, readings(BY_FACES), 1e-9)[1] > 10.0 * told(PLAIN, readings(PLAIN), 1e-9)[1])


def test_a_magnetometer_needs_light_where_its_stray_field_does():
    assert PLAIN.needs == BY_COLUMNS.needs == frozenset() and BY_FACES.needs == {"light"}
    with pytest.raises(ValueError, match="Magnetometer.stray: expected 6 rows, one a source, got 2"):
        Magnetometer(stray=STRAY[:2])
    dark = eqx.tree_at(lambda v: v.light, jax.tree.map(lambda x: x[0], VIEWS), None)
    with pytest.raises(ValueError, match="View.light is None"):
        BY_FACES(dark)
    assert np.all(np.isfinite(PLAIN(dark)))


def test_a_magnetometer_of_scale_zero_has_directions_all_the_same():
    # As at the bound of a fit: nothing is known of that axis, and nothing may fail.
    sensor = Magnetometer(scale=(1.0, 0.0, 1.0))
    found = sensor.direct(np.array([[3e-5, 1e-5, -2e-5]]), 1e-7)
    assert found is not None
    expected = np.array([3.0, 0.0, -2.0]) / np.sqrt(13.0)
    np.testing.assert_allclose(found[0][0], expected, atol=1e-12)
