"""Apparent Sun: almanac values, motion over a session; the traced series: published values and derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import AU
from jaxsat.environment import Sun, apparent_sun, sun_direction, sun_position
from jaxsat.time import Epoch

MUNIN = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
position = jax.jit(sun_position)
direction = jax.jit(sun_direction)
state = jax.jit(lambda sun, t: sun(t))
directions = jax.jit(jax.vmap(lambda sun, t: sun.direction(t), (None, 0)))
forward, reverse = jax.jit(jax.jacfwd(sun_position)), jax.jit(jax.jacrev(sun_position))
# An hour, in centuries and in seconds.
HOUR = (3600 / 86400 / 36525, 3600.0)


def right_ascension_declination_deg(vector):
    return np.degrees(np.arctan2(vector[1], vector[0])) % 360, np.degrees(np.arcsin(vector[2]))


def test_almanac_of_1992():
    # Meeus 1998, example 25.b (VSOP87, apparent): 1992 October 13, 0h TD; TD - UTC = 59.184 s.
    sun, distance = apparent_sun(Epoch.from_utc(1992, 10, 12, 23, 59, 0.816), np.zeros(1))
    ra, dec = right_ascension_declination_deg(sun[0])
    arcsecond = 1 / 3600
    assert ra == pytest.approx((13 + 13 / 60 + 30.749 / 3600) * 15, abs=0.1 * arcsecond)
    assert dec == pytest.approx(-(7 + 47 / 60 + 1.74 / 3600), abs=0.1 * arcsecond)
    assert distance[0] / AU == pytest.approx(0.99760853, abs=1e-6)


def test_munin_epoch():
    sun, _ = apparent_sun(Epoch.from_utc(2001, 1, 18, 4, 54, 15), np.zeros(1))
    # The reference value comes from Meeus' low-accuracy formula (good to 0.01 deg), hence the tolerance.
    assert right_ascension_declination_deg(sun[0]) == pytest.approx((300.265358, -20.528203), abs=0.005)


def test_spline_agrees_with_single_instants():
    epoch = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
    t_s = np.array([0.0, 1.0, 2345.6, 40000.0, 86400.0])
    sun, distance = apparent_sun(epoch, t_s)
    np.testing.assert_allclose(np.linalg.norm(sun, axis=1), 1.0, rtol=1e-14)
    for t, expected, d in zip(t_s, sun, distance, strict=True):
        alone, alone_distance = apparent_sun(epoch.shifted(float(t)), np.zeros(1))
        np.testing.assert_allclose(alone[0], expected, atol=1e-12)
        assert alone_distance[0] == pytest.approx(d, abs=1.0)


def test_no_times():
    sun, distance = apparent_sun(Epoch.from_utc(2001, 1, 18), np.zeros(0))
    assert sun.shape == (0, 3) and distance.shape == (0,)


def test_series_of_the_published_example():
    # Meeus 1998, example 25.b, as above; T from its page. The series is good to 2": see `sun_position`.
    unit, distance = direction(jnp.asarray(-0.072183436))
    ra, dec = right_ascension_declination_deg(np.asarray(unit))
    assert np.linalg.norm(unit) == pytest.approx(1.0, abs=1e-14)
    assert ra == pytest.approx((13 + 13 / 60 + 30.749 / 3600) * 15, abs=0.0006)
    assert dec == pytest.approx(-(7 + 47 / 60 + 1.74 / 3600), abs=0.0006)
    assert float(distance) / AU == pytest.approx(0.99760853, abs=1e-5)


def test_series_from_an_epoch():
    t_s = np.array([-86400.0, 0.0, 4500.0, 10 * 86400.0])
    found, distance = directions(Sun(MUNIN.tt_centuries()), jnp.asarray(t_s))
    exact, exact_distance = apparent_sun(MUNIN, t_s)
    # Stated: 0.0007 deg, 1.2e-5 rad.
    np.testing.assert_allclose(found, exact, atol=1.2e-5)
    np.testing.assert_allclose(distance, exact_distance, rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("centuries", [-0.1, 0.0, 0.0104, 0.31])
def test_derivative_of_the_series(centuries):
    t = jnp.asarray(centuries)
    slope = forward(t)
    step = HOUR[0]
    difference = (position(t + step) - position(t - step)) / (2 * step)
    # Rounding of 1.5e11 m over two hours is 1e-9 of the speed; the third derivative's share is 1e-7.
    np.testing.assert_allclose(slope, difference, atol=1e-6 * float(np.linalg.norm(difference)))
    np.testing.assert_allclose(reverse(t), slope, rtol=1e-9)


@pytest.mark.slow
def test_state_is_position_and_its_rate():
    sun = Sun(MUNIN.tt_centuries())
    (place, velocity), step = state(sun, jnp.asarray(1e5)), HOUR[1]
    np.testing.assert_allclose(place, position(jnp.asarray(MUNIN.tt_centuries() + 1e5 / 86400 / 36525)), rtol=1e-12)
    difference = state(sun, jnp.asarray(1e5 + step))[0] - state(sun, jnp.asarray(1e5 - step))[0]
    np.testing.assert_allclose(velocity, difference / (2 * step), atol=1e-6 * float(np.linalg.norm(velocity)))
    # The Earth's speed about the Sun, 29.3 to 30.3 km/s.
    assert 29.2e3 < np.linalg.norm(velocity) < 30.4e3
    sun.check_span(np.array([-1e9, 1e9]))


def test_series_in_single_precision():
    unit, distance = direction(jnp.asarray(0.3, jnp.float32))
    exact, _ = direction(jnp.asarray(0.3))
    assert unit.dtype == distance.dtype == jnp.float32
    # Stated: 0.003 deg.
    np.testing.assert_allclose(unit, exact, atol=np.radians(0.003))
