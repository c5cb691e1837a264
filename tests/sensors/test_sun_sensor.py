"""Pyramid Sun sensor: the published geometry, which faces light up and which stay dark, detectors, steps, slopes."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.estimation.sun.published import two_current_limit
from jaxsat.math.scalars import elements, over_cases
from jaxsat.sensors.sun_sensor import (
    PyramidSunSensor,
    combine_detectors,
    face_currents,
    lit_fraction,
    quantize,
    safe_sqrt,
)

SENSOR = PyramidSunSensor()
S, C = np.sin(np.radians(22.0)), np.cos(np.radians(22.0))
EDGE = np.cos(np.radians(83.0))
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
currents = quick(jax.vmap(lambda sun: face_currents(SENSOR, sun)))
share = quick(jax.vmap(lambda x: lit_fraction(SENSOR, x)))


def direction(angle_deg, azimuth_deg):
    """Directions at angles from the axis and azimuths from y toward z, eq. 8."""
    a, p = np.radians(angle_deg), np.radians(azimuth_deg)
    return np.stack(np.broadcast_arrays(np.cos(a), np.sin(a) * np.cos(p), np.sin(a) * np.sin(p)), axis=-1)


def test_published_angles_and_distance():
    assert np.degrees(two_current_limit(SENSOR)) == pytest.approx(20.454791, abs=5e-7)
    assert float(SENSOR.hood_distance()) == pytest.approx(3.608081, abs=5e-7)
    # The edge between two faces, y cross z, leans inward; square to it is the fold of the two solutions, eq. 16.
    normals = np.asarray(SENSOR.normals())
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-15)
    along = np.cross(normals[2], normals[0])
    assert np.degrees(np.arcsin(abs(along[0]) / np.linalg.norm(along))) == pytest.approx(60.257244, abs=5e-7)


@pytest.mark.parametrize(
    ("begin", "end", "counts"),
    [
        (0.0, 15.0, {4}),
        (15.0, 20.454791, {3, 4}),
        (20.454792, 71.014660, {2, 3}),
        (71.014661, 74.0, {1, 2}),
        (74.0, 90.0, {1, 2}),
        (90.0, 180.0, {0}),
    ],
)
def test_faces_lit_in_each_range(begin, end, counts):
    """Table 1, to 1e-5 deg from the boundaries; ranges that differ in the errors alone are one here."""
    angles = np.linspace(begin + 1e-5, end - 1e-5, 60)
    sun = direction(angles[:, None], np.arange(0.0, 360.0, 0.5)[None]).reshape(-1, 3)
    assert set(np.sum(np.asarray(currents(sun)) > 0.0, axis=1).tolist()) == counts


def test_shaded_share():
    angles = np.array([75.0, 76, 78, 80, 85, 89])
    found = np.asarray(share(np.cos(np.radians(angles))))
    np.testing.assert_allclose(found, [0.940853, 0.881452, 0.761735, 0.640534, 0.328833, 0.067450], atol=5e-7)
    # The ray past the hood's edge A, at (x, z) = (0, -AB) with the face's upper edge B at the origin, meets the face,
    # which falls off along (-cos 22, sin 22), at the share's length from B: as lines cross, without the law of sines.
    for angle, expected in zip(angles, found, strict=True):
        ray = np.array([-np.cos(np.radians(angle)), -np.sin(np.radians(angle))])
        length = np.linalg.solve(np.array([[-C, S], -ray]).T, [0.0, np.sin(np.radians(96)) / np.sin(np.radians(16))])[0]
        assert length == pytest.approx(expected, rel=1e-12)
    outside = np.asarray(share(np.array([1.0, 0.5, np.cos(np.radians(74.0)) + 1e-12, 0.0, -0.3])))
    np.testing.assert_array_equal(outside, [1.0, 1.0, 1.0, 0.0, 0.0])


def test_each_face_looks_its_own_way():
    """1 to 4 toward +z, -z, +y, -y; a Sun behind the base gives nothing, one on the axis the same to all."""
    for face, azimuth in enumerate([90.0, 270.0, 0.0, 180.0]):
        angles = np.array([5.0, 30.0, 60.0, 73.0, 85.0])
        found = np.asarray(currents(direction(angles, azimuth)))
        np.testing.assert_array_equal(np.argmax(found, axis=1), face)
        opposite = face + 1 - 2 * (face % 2)
        assert np.all(found[1:, opposite] == 0.0) and found[0, opposite] > 0.0
        expected = np.cos(np.radians(angles - 68.0)) * np.asarray(share(np.cos(np.radians(angles))))
        np.testing.assert_allclose(found[:, face], expected, atol=1e-15)
    behind = np.random.default_rng(1).normal(size=(200, 3))
    behind[:, 0] = -abs(behind[:, 0])
    np.testing.assert_array_equal(currents(behind / np.linalg.norm(behind, axis=1)[:, None]), 0.0)
    np.testing.assert_array_equal(currents(np.array([[0.0, 0.6, 0.8]])), 0.0)
    np.testing.assert_allclose(currents(np.array([[1.0, 0.0, 0.0]])), S, atol=1e-16)
    bright = quick(face_currents)(PyramidSunSensor(max_current=0.02), jnp.asarray(direction(40.0, 20.0)))
    np.testing.assert_allclose(bright, 0.02 * np.asarray(currents(direction(40.0, 20.0)[None]))[0], rtol=1e-15)


def test_total_reflection_is_a_step():
    """A Sun over -z leaves face 1 at 15 deg from the axis, where it still had cos 83."""
    found = np.asarray(currents(direction(15.0 + np.array([-1e-9, 1e-9]), 270.0)))[:, 0]
    assert found[0] == pytest.approx(EDGE, abs=1e-10) and found[1] == 0.0


@pytest.mark.parametrize("face", range(4))
@pytest.mark.parametrize("detector", range(2))
@pytest.mark.parametrize("left", [0.0, 0.3])
def test_any_one_detector_of_a_face_may_fail(face, detector, left):
    """`left` of its current, so that some are lost and some only weakened."""
    faces = np.asarray(currents(direction(12.0, 33.0)[None]))[0]
    readings = np.stack([faces, faces], axis=1)
    readings[face, detector] *= left
    np.testing.assert_allclose(combine_detectors(jnp.asarray(readings)), faces, rtol=1e-15)


def test_pairs_that_agree_are_averaged_and_dead_ones_dark():
    readings = jnp.asarray([[0.5, 0.52], [0.3, 0.3], [0.0, 0.0], [0.2, 0.09]])
    np.testing.assert_allclose(combine_detectors(readings), [0.51, 0.3, 0.0, 0.2], rtol=1e-15)


def test_steps_of_a_converter():
    found = quantize(jnp.asarray([0.0, 0.014, 0.016, 0.499, -0.4, 0.025]), 0.01)
    np.testing.assert_allclose(found, [0.0, 0.01, 0.02, 0.5, 0.0, 0.02], atol=1e-15)
    values = jnp.linspace(0.0, 1.0, 777)
    assert float(jnp.max(jnp.abs(quantize(values, 1 / 255) - values))) <= 0.5 / 255 + 1e-15


SLOPES = {name: quick(jax.vmap(way(lambda sun: face_currents(SENSOR, sun)))) for name, way in
          (("forward", jax.jacfwd), ("reverse", jax.jacrev))}  # fmt: skip


@pytest.mark.parametrize("way", SLOPES)
def test_slopes_against_differences(way):
    sun = direction(np.linspace(0.0, 89.5, 60) + 0.03, 360.0 * np.arange(60) * 0.618)
    h = 1e-7
    cosines = sun @ np.asarray(SENSOR.normals()).T
    assert np.min(abs(cosines - EDGE)) > 10 * h
    difference = np.stack([(currents(sun + h * e) - currents(sun - h * e)) / (2 * h) for e in np.eye(3)], axis=-1)
    # Rounding is 1e-16 / 1e-7; of the share the second derivative is 20 at most and the third 200.
    np.testing.assert_allclose(SLOPES[way](sun), difference, atol=1e-8)


@pytest.mark.parametrize("way", SLOPES)
def test_slopes_at_edges_are_those_of_one_side(way):
    """On the axis, at the hood's edge from both sides and on it, at the angle of total reflection, at 90 deg."""
    hood = np.arccos(np.cos(np.radians(74.0)))
    at = np.array([0.0, hood - 1e-9, hood, hood + 1e-9, np.radians(71.014660), np.pi / 2, np.radians(91.0)])
    sun = np.concatenate([direction(np.degrees(at), 90.0), direction(np.array([15.0, 20.454791]), 45.0)])
    sun = np.concatenate([sun, [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]])
    found = np.asarray(SLOPES[way](sun))
    assert np.all(np.isfinite(found))
    normals = np.asarray(SENSOR.normals())
    np.testing.assert_allclose(found[0], normals, atol=1e-15)
    np.testing.assert_allclose(found[1, 0], normals[0], atol=1e-15)
    # Of the share: d/da of AB cos a / sin(22 + a) is -AB cos 22 / sin^2(22 + a), and dx = -sin a da.
    slope = SENSOR.hood_distance() * C / np.sin(np.radians(96.0)) ** 2 / np.sin(hood)
    expected = normals[0] + np.array([slope * np.cos(np.radians(6.0)), 0.0, 0.0])
    np.testing.assert_allclose(found[3, 0], expected, atol=1e-7)
    # On the edge either side is right; at 90 deg and beyond nothing is left to change.
    assert min(abs(found[2, 0, 0] - normals[0, 0]), abs(found[2, 0, 0] - expected[0])) < 1e-12
    np.testing.assert_array_equal(found[6], 0.0)


def test_slope_of_the_share_and_of_the_root():
    slope = quick(jax.vmap(jax.grad(lambda x: lit_fraction(SENSOR, x))))
    x, h = np.cos(np.radians([75.0, 80.0, 89.0, 60.0, 10.0])), 1e-7
    np.testing.assert_allclose(slope(x), (share(x + h) - share(x - h)) / (2 * h), atol=1e-7)
    assert np.all(np.isfinite(slope(np.array([1.0, 0.0, -0.2, -1.0, np.cos(np.radians(74.0))]))))
    root = quick(jax.vmap(jax.value_and_grad(safe_sqrt)))
    value, slope = root(np.array([4.0, 0.0, -1.0]))
    np.testing.assert_array_equal(value, [2.0, 0.0, 0.0])
    np.testing.assert_array_equal(slope, [0.25, 0.0, 0.0])


def test_every_number_of_the_sensor_has_a_slope():
    """Angles and brightness may be fitted: slopes by them against differences, in the shade."""
    sun = jnp.asarray(direction(79.0, 60.0))

    def of(numbers):
        return face_currents(PyramidSunSensor(numbers[0], numbers[1], numbers[2], numbers[3]), sun)

    numbers, h = jnp.asarray([*np.radians([22.0, 83.0, 74.0]), 0.5]), 1e-7
    value, slope = quick(of), quick(jax.jacrev(of))(numbers)
    difference = np.stack([(value(numbers + h * e) - value(numbers - h * e)) / (2 * h) for e in jnp.eye(4)], axis=-1)
    np.testing.assert_allclose(slope, difference, atol=1e-8)
    assert np.all(np.abs(np.asarray(slope)[0, [0, 2, 3]]) > 0.01)


def test_replayed_over_cases():
    sun = direction(np.linspace(0.0, 95.0, 40), 17.0 * np.arange(40))
    like = jax.ShapeDtypeStruct((3,), float)
    replayed = over_cases(lambda v: quantize(face_currents(SENSOR, v), 1e-3), like)
    found = quick(lambda v: jnp.stack(list(replayed(elements(v.T, element_rank=1)))))(jnp.asarray(sun))
    # A step away where rounding decides between two: of 160 numbers none does.
    np.testing.assert_allclose(found.T, quantize(currents(sun), 1e-3), atol=1e-15)
