"""Elevations of the Sun by photodiodes: against NumPy, slopes up to the axis, the satellite file."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sample_views import FACES, LIT, SUNS, VIEWS, body, earthlight, readings, slopes, some, told, view_of
from scipy.spatial.transform import Rotation

from jaxsat.sensors import SunElevation
from jaxsat.sensors.sunlight.sun_elevation import STRAIGHT_FROM, elevation_of_light

GAIN = np.linspace(0.85, 0.95, 6)
TILTS = np.random.default_rng(8).normal(scale=0.1, size=(6, 2))
RIM = np.random.default_rng(9).normal(scale=0.1, size=(6, 8))
LEVEL, TILTED = SunElevation(FACES, GAIN), SunElevation(FACES, GAIN, TILTS)
RIMMED = SunElevation(FACES, GAIN, None, RIM)


def tilted_faces():
    """Of a face of a box the turns are about the two other axes."""
    others = [np.delete(np.eye(3), axis, axis=0) for axis in (0, 0, 1, 1, 2, 2)]
    pairs = zip(FACES, TILTS, others, strict=True)
    return np.array([Rotation.from_rotvec(tilt @ two).apply(face) for face, tilt, two in pairs])


@pytest.mark.parametrize(("sensor", "normals"), [(LEVEL, FACES), (TILTED, tilted_faces())], ids=["level", "tilted"])
def test_reading_is_the_arcsine_of_the_light(sensor, normals):
    light = GAIN * (LIT[:, None] * np.maximum(body(SUNS) @ normals.T, 0.0) + earthlight(normals))
    sure = light < np.sin(STRAIGHT_FROM)
    found = readings(sensor)
    np.testing.assert_allclose(found[sure], np.arcsin(light[sure]), atol=1e-12)
    assert np.all(found[light >= 1.0] == 0.5 * np.pi)


def test_the_rim_is_a_sum_of_waves_of_the_azimuth():
    share = np.zeros((len(SUNS), 6))
    for face, axis in enumerate((0, 0, 1, 1, 2, 2)):
        u, v = np.delete(body(SUNS), axis, axis=1).T
        for m in range(1, 5):
            wave = RIM[face, 2 * m - 2] * np.cos(m * np.arctan2(v, u)) + RIM[face, 2 * m - 1] * np.sin(
                m * np.arctan2(v, u)
            )
            share[:, face] += np.hypot(u, v) ** 8 * wave
    light = LIT[:, None] * np.maximum(body(SUNS) @ FACES.T, 0.0) * (1.0 + share)
    expected = np.arcsin(np.clip(GAIN * (light + earthlight(FACES)), 0.0, 1.0))
    sure = expected < STRAIGHT_FROM
    np.testing.assert_allclose(readings(RIMMED)[sure], expected[sure], atol=1e-12)


def test_without_light_of_the_earth_it_is_the_elevation_itself():
    sensor = SunElevation(FACES, np.ones(6), earthlight=False)
    views = VIEWS.light.illumination == 1.0
    expected = np.arcsin(np.clip(body(SUNS) @ FACES.T, 0.0, 1.0))[np.asarray(views)]
    np.testing.assert_allclose(readings(sensor)[np.asarray(views)], expected, atol=1e-2)


def test_slopes_are_differences():
    for sensor in (LEVEL, TILTED, RIMMED):
        forward, reverse, differences = slopes(sensor, some(1, 4, 9))
        np.testing.assert_allclose(forward, differences, atol=3e-9 * np.abs(forward).max())
        np.testing.assert_allclose(reverse, forward, atol=1e-12 * np.abs(forward).max())


def test_slopes_are_finite_in_the_dark_on_the_axis_and_beyond_all_light():
    z = [[0.0, 0.0, 1.0]]
    angles = np.array([0.0, np.radians(0.25), 0.5 * np.pi, np.pi])
    suns = [(np.sin(angle), 0.0, np.cos(angle)) for angle in angles]
    views = jax.tree.map(lambda *x: jnp.stack(x), *(view_of(Rotation.identity(), sun=sun) for sun in suns))
    for gain in (0.9, 1.0, 1.3):
        forward, reverse, _ = slopes(SunElevation(z, [gain], [[0.0, 0.0]], np.full((1, 8), 0.1)), views)
        assert np.all(np.isfinite(forward)) and np.all(np.isfinite(reverse))
        # Nothing is more than a right angle, and from behind the Sun changes nothing.
        assert np.all(forward[3] == 0.0) and (gain < 1.2 or np.all(forward[0] == 0.0))


def test_the_straight_end_goes_on_from_the_arcsine():
    light = jnp.asarray([-0.1, 0.0, 0.5, np.sin(STRAIGHT_FROM), 1.0, 1.4])
    expected = [0.0, 0.0, np.pi / 6.0, STRAIGHT_FROM, 0.5 * np.pi, 0.5 * np.pi]
    np.testing.assert_allclose(elevation_of_light(light), expected, atol=1e-12)
    rising = np.diff(np.asarray(elevation_of_light(jnp.linspace(0.0, 1.0, 4001))))
    assert np.all(rising > 0.0)


def test_several_diodes_find_the_sun_and_one_does_not():
    clear = SunElevation(FACES, GAIN, TILTS, earthlight=False)
    bright = LIT == 1.0
    found, sigma = told(clear, readings(clear), 1e-4)
    apart = np.arccos(np.clip(np.sum(found * body(SUNS), axis=1), -1.0, 1.0))
    sure = (sigma < 0.01) & bright
    assert np.mean(sure[bright]) > 0.5 and apart[sure].max() < 1e-3
    one = SunElevation(FACES[:1], [1.0])
    assert np.all(np.isnan(told(one, readings(one), 0.01)[1]))


def test_noise_leaves_an_elevation():
    keys = jax.random.split(jax.random.key(0), 400)
    noisy = np.asarray(jax.jit(jax.vmap(lambda key: LEVEL.noisy(jnp.asarray([0.0, 0.7, 1.57]), 0.05, key)))(keys))
    assert noisy.min() == 0.0 and noisy.max() == pytest.approx(0.5 * np.pi)
    assert np.std(noisy[:, 1]) == pytest.approx(0.05, rel=0.1)
