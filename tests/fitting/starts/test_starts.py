"""First guesses: the Sun where the currents say it is, rolls and rates spread evenly."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.starts.first_guesses import random_starts, sun_direction_body

RNG = np.random.default_rng(0)
NORMALS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def rotation(q) -> Rotation:
    return Rotation.from_quat(np.asarray(q)[..., [1, 2, 3, 0]])


def test_sun_is_read_from_the_panels_of_a_box():
    for sun in (*unit(RNG.normal(size=(20, 3))), *NORMALS, unit(np.array([1.0, 0.0, -1.0]))):
        currents = 0.24 * np.maximum(NORMALS @ sun, 0.0)
        np.testing.assert_allclose(sun_direction_body(jnp.asarray(currents)), sun, atol=1e-15)


def test_weaker_panel_of_a_pair_is_light_of_the_earth():
    found = sun_direction_body(jnp.array([0.1, 0.05, 0.02, 0.2, 0.0, 0.0]))
    np.testing.assert_allclose(found, unit(np.array([0.1, -0.2, 0.0])), atol=1e-15)


@pytest.mark.slow
def test_random_starts_are_spread_evenly_under_the_sun():
    sun_body, sun_eci = unit(RNG.normal(size=(2, 3)))
    currents = jnp.asarray(0.24 * np.maximum(NORMALS @ sun_body, 0.0))
    count, limit = 4096, 0.026
    arguments = (count, currents, jnp.asarray(sun_eci), jnp.asarray(limit))
    attitude, rate = (np.asarray(a) for a in random_starts(jax.random.key(3), *arguments))
    np.testing.assert_allclose(np.linalg.norm(attitude, axis=1), 1.0, atol=1e-14)
    turns = rotation(attitude)
    np.testing.assert_allclose(turns.apply(sun_body), np.broadcast_to(sun_eci, (count, 3)), atol=1e-12)

    # Rolls about the Sun: any vector across it points everywhere in its plane equally.
    across = turns.apply(unit(np.cross(sun_body, [0.1, 0.2, 0.9])))
    basis = unit(np.cross(sun_eci, [0.9, 0.1, 0.2]))
    angle = np.arctan2(across @ np.cross(sun_eci, basis), across @ basis)
    assert np.histogram(angle, 16, (-np.pi, np.pi))[0] == pytest.approx(count / 16, abs=3)

    speed = np.linalg.norm(rate, axis=1)
    assert speed.max() <= limit
    # Moments of a uniform ball: <w> = 0, <w_i w_j> = R^2/5 delta_ij, <|w|^3> = R^3/2; five sigma of the mean of 4096.
    np.testing.assert_allclose(rate.mean(axis=0), 0.0, atol=5 * limit / np.sqrt(5 * count))
    np.testing.assert_allclose(rate.T @ rate / count, limit**2 / 5 * np.eye(3), atol=5 * limit**2 * 0.26 / count**0.5)
    assert np.mean(speed**3) == pytest.approx(limit**3 / 2, rel=1e-3)

    again = random_starts(jax.random.key(3), *arguments)
    np.testing.assert_array_equal(again[0], attitude)
    np.testing.assert_array_equal(again[1], rate)
    other = random_starts(jax.random.key(4), *arguments)
    assert not np.any(np.all(np.asarray(other[1]) == rate, axis=1))
