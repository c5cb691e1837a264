"""The Moon's series: a published example, eclipses computed from JPL's integration, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import Moon, moon_position, sun_position
from jaxsat.time import Epoch

position = jax.jit(moon_position)
positions = jax.jit(jax.vmap(moon_position))
sun_positions = jax.jit(jax.vmap(sun_position))
state = jax.jit(lambda moon, t: moon(t))
forward, reverse = jax.jit(jax.jacfwd(moon_position)), jax.jit(jax.jacrev(moon_position))
EARTH_RADIUS = 6378137.0

# Geocentric Sun and Moon at greatest eclipse, from JPL's DE200/LE200 (Espenak & Anderson, NASA eclipse bulletins and
# monographs, table 1): Julian date TDT; right ascension h m s, declination deg ' ", each of Sun and Moon; the Moon's
# equatorial horizontal parallax ".
ECLIPSES = """
    2451401.961215  9 23  8.297 +15 19 39.72   9 23 34.531 +15 48 38.51  3524.24
    2452612.814070 16 41 50.939 -22 13 29.20  16 41 32.881 -22 31  5.17  3602.27
    2452790.673176  4 30 33.482 +21 50 57.15   4 29 35.526 +22 43 13.15  3259.28
    2452967.451639 15 56 23.195 -20 24 22.85  15 55  7.521 -21 20 45.70  3687.25
    2453469.358917  1 10 30.278  +7 28 47.25   1 11  8.328  +7 10 59.27  3488.96
    2453646.939435 12 37 55.021  -4  5  4.22  12 38 30.321  -3 49  4.75  3322.09
    2453823.925261  0 31 31.738  +3 24 10.34   0 30 46.588  +3 44 36.25  3651.40
"""


def directions_from_sexagesimal(fields):
    """Unit vectors from rows of h m s deg ' " (the sign on the degrees)."""
    sexagesimal = np.array([1.0, 1 / 60, 1 / 3600])
    ra = np.radians(15 * fields[:, :3] @ sexagesimal)
    dec = np.radians(np.sign(fields[:, 3]) * (np.abs(fields[:, 3:]) @ sexagesimal))
    return np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=1)


def test_published_example():
    # Meeus 1998, example 47.a: 1992 April 12, 0h TD. Apparent right ascension and declination, and along the ecliptic
    # of the true obliquity 23.440636 deg: apparent longitude 133.167265 (133.162655 before nutation), latitude.
    place = np.asarray(position(jnp.asarray(-0.077221081451)))
    distance = np.linalg.norm(place)
    x, y, z = place / distance
    # The page rounds its nutation to 0.04".
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(134.688470, abs=2e-5)
    assert np.degrees(np.arcsin(z)) == pytest.approx(13.768368, abs=2e-5)
    assert distance == pytest.approx(368409.7e3, abs=60.0)
    c, s = np.cos(np.radians(23.440636)), np.sin(np.radians(23.440636))
    assert np.degrees(np.arctan2(c * y + s * z, x)) == pytest.approx(133.167265, abs=2e-5)
    assert np.degrees(np.arcsin(c * z - s * y)) == pytest.approx(-3.229126, abs=2e-5)


def test_eclipses_from_the_integration_of_jpl():
    rows = np.array(ECLIPSES.split(), float).reshape(-1, 14)
    t = jnp.asarray((rows[:, 0] - 2451545.0) / 36525.0)
    moon, sun = np.asarray(positions(t)), np.asarray(sun_positions(t))
    distance = np.linalg.norm(moon, axis=1)
    off = np.degrees(moon / distance[:, None] - directions_from_sexagesimal(rows[:, 7:13]))
    # Meeus gives his series 10" in longitude and 4" in latitude; the Sun's is stated at 0.0007 deg.
    assert np.max(np.linalg.norm(off, axis=1)) < 11 / 3600
    off = np.degrees(sun / np.linalg.norm(sun, axis=1)[:, None] - directions_from_sexagesimal(rows[:, 1:7]))
    assert np.max(np.linalg.norm(off, axis=1)) < 0.0007
    # The parallax is printed to 0.01", 1 km; the series leaves some km more (0.2" of parallax: Meeus, page 338).
    np.testing.assert_allclose(np.degrees(np.arcsin(EARTH_RADIUS / distance)) * 3600, rows[:, 13], atol=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("centuries", [-0.1, 0.0, 0.0104, 0.31])
def test_derivative(centuries):
    t, step = jnp.asarray(centuries), 600 / 86400 / 36525
    slope = forward(t)
    difference = (position(t + step) - position(t - step)) / (2 * step)
    # The phases' 1e3 rad resolve 1e-13 rad, 4e-8 of the motion in 600 s; the third derivative's share is 4e-7.
    np.testing.assert_allclose(slope, difference, atol=2e-6 * float(np.linalg.norm(difference)))
    np.testing.assert_allclose(reverse(t), slope, rtol=1e-9)


def test_state_is_position_and_its_rate():
    epoch = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
    moon = Moon(epoch.tt_centuries())
    (place, velocity), step = state(moon, jnp.asarray(1e5)), 600.0
    np.testing.assert_allclose(place, position(jnp.asarray(epoch.shifted(1e5).tt_centuries())), atol=1.0)
    difference = state(moon, jnp.asarray(1e5 + step))[0] - state(moon, jnp.asarray(1e5 - step))[0]
    np.testing.assert_allclose(velocity, difference / (2 * step), atol=2e-6 * float(np.linalg.norm(velocity)))
    # Perigee 1.08, apogee 0.97 km/s.
    assert 0.95e3 < np.linalg.norm(velocity) < 1.1e3
    moon.check_span(np.array([-1e9, 1e9]))


def test_single_precision_stays_single():
    t = 0.3
    single, double = position(jnp.asarray(t, jnp.float32)), np.asarray(position(jnp.asarray(t)))
    assert single.dtype == jnp.float32
    # Stated: 0.03 deg.
    np.testing.assert_allclose(single, double, atol=np.radians(0.03) * float(np.linalg.norm(double)))
