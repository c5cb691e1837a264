"""Limb angles: geometry by hand, an independent rotation library, slopes, and the poles where the turn is no angle."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.math import quaternion
from jaxsat.sensors.limb import limb_distance, limb_turn, nadir_body

R = 6371.2e3
HIGH = 2.0 * R
"""Here the Earth's disk has a radius of 30 deg."""

distance, turn = jax.jit(limb_distance), jax.jit(limb_turn)


def attitude(rotation: Rotation) -> jnp.ndarray:
    return jnp.asarray(rotation.as_quat(scalar_first=True))


def both(rotation: Rotation, position) -> np.ndarray:
    q, r = attitude(rotation), jnp.asarray(position)
    return np.degrees([distance(q, r, jnp.asarray(R)), turn(q, r)])


@pytest.mark.parametrize(
    ("about", "angle", "expected"),
    [
        # Above inertial +z, so that the nadir is -z: upright, x looks along the horizon, 60 deg outside the disk.
        ("z", 0.0, (60.0, -90.0)),
        # Right-handed about y, x goes from +x towards -z, the nadir: half-way, on the limb, at the disk's centre.
        ("y", 45.0, (15.0, -90.0)),
        ("y", 60.0, (0.0, -90.0)),
        ("y", 80.0, (-20.0, -90.0)),
        ("y", -60.0, (120.0, -90.0)),
        # Turned about x itself, the nadir goes the other way round: from -z over -y to +z, or over +y.
        ("x", 30.0, (60.0, -120.0)),
        ("x", 90.0, (60.0, 180.0)),
        ("x", -90.0, (60.0, 0.0)),
        ("x", -120.0, (60.0, 30.0)),
    ],
)
def test_by_hand(about, angle, expected):
    found = both(Rotation.from_euler(about, angle, degrees=True), [0.0, 0.0, HIGH])
    difference = found - np.array(expected)
    np.testing.assert_allclose([difference[0], np.remainder(difference[1] + 180.0, 360.0) - 180.0], 0.0, atol=1e-9)


def test_any_attitude_and_place():
    """Against direction cosines by SciPy: cos(A + asin(R / r)) and the tangent of B, in its quadrant."""
    rng = np.random.default_rng(1)
    for rotation in Rotation.random(20, rng=rng):
        position = rng.normal(size=3)
        position *= rng.uniform(1.05, 5.0) * R / np.linalg.norm(position)
        nadir = rotation.inv().apply(-position / np.linalg.norm(position))
        expected = [np.arccos(nadir[0]) - np.arcsin(R / np.linalg.norm(position)), np.arctan2(nadir[2], nadir[1])]
        np.testing.assert_allclose(np.radians(both(rotation, position)), expected, atol=1e-12)
        np.testing.assert_allclose(nadir_body(attitude(rotation), jnp.asarray(position)), nadir, atol=1e-14)


@jax.jit
def turned_angles(rotation, q):
    """(distance, turn) after a small rotation in body axes."""
    turned = quaternion.multiply(q, quaternion.from_rotation_vector(rotation))
    position = jnp.asarray([0.0, 0.0, HIGH])
    return jnp.stack([limb_distance(turned, position, R), limb_turn(turned, position)])


@jax.jit
def slopes(q):
    """Their derivatives by the rotation, forward and reverse."""
    return tuple(mode(turned_angles)(jnp.zeros(3), q) for mode in (jax.jacfwd, jax.jacrev))


@pytest.mark.slow
@pytest.mark.parametrize("off_pole_deg", [90.0, 20.0, 1.0, 1e-3])
def test_slopes_are_central_differences(off_pole_deg):
    """Also near the pole, where the turn's slope grows as 1 / sin and the difference needs a step far below it."""
    off = np.radians(off_pole_deg)
    q = attitude(Rotation.from_euler("y", 0.5 * np.pi - off) * Rotation.from_euler("x", 0.7))
    nadir = np.asarray(nadir_body(q, jnp.asarray([0.0, 0.0, HIGH])))
    forward, reverse = slopes(q)
    h = 1e-4 * min(np.hypot(nadir[1], nadir[2]), 1.0)
    for k, shift in enumerate(h * np.eye(3)):
        numeric = np.asarray(turned_angles(shift, q) - turned_angles(-shift, q)) / (2.0 * h)
        # Rounding of 1e-16 over h and over the distance from the pole, and h^2 of curvature in units of that distance.
        tolerance = 1e-15 / h + 1e-7 * np.abs(forward).max()
        np.testing.assert_allclose(forward[:, k], numeric, atol=tolerance)
    np.testing.assert_allclose(forward, reverse, atol=1e-12 * np.abs(forward).max())


@pytest.mark.parametrize(("pitch", "expected"), [(90.0, -30.0), (-90.0, 150.0)])
def test_pole_has_no_turn_and_a_finite_slope(pitch, expected):
    """x at the nadir, or away from it."""
    q = attitude(Rotation.from_euler("y", pitch, degrees=True))
    forward, reverse = slopes(q)
    np.testing.assert_allclose(np.degrees(turned_angles(jnp.zeros(3), q)), [expected, 0.0], atol=1e-9)
    assert np.all(np.isfinite(forward)) and np.all(np.isfinite(reverse))
    np.testing.assert_array_equal(forward[1], 0.0)


def test_batches():
    rotations = Rotation.random(5, rng=np.random.default_rng(2))
    q = jnp.asarray(rotations.as_quat(scalar_first=True))
    position = jnp.asarray([HIGH, 0.0, 0.0])
    many = (
        jax.jit(jax.vmap(limb_distance, (0, None, None)))(q, position, jnp.asarray(R)),
        jax.jit(jax.vmap(limb_turn, (0, None)))(q, position),
    )
    for k, rotation in enumerate(rotations):
        np.testing.assert_allclose(np.degrees([many[0][k], many[1][k]]), both(rotation, [HIGH, 0.0, 0.0]), rtol=1e-13)
