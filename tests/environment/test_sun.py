"""Apparent Sun: almanac values, motion over a session."""

import numpy as np
import pytest

from jaxsat.constants import AU
from jaxsat.environment import apparent_sun
from jaxsat.time import Epoch


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
