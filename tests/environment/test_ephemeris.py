"""Sun, Moon and Greenwich at many instants: published places, independent code, and the same one by one."""

import erfa
import numpy as np
import pytest

from jaxsat.environment import apparent_moon, ephemeris
from jaxsat.frames import dcm_eci_from_gcrf, dcms_eci_from_gcrf
from jaxsat.time import Epoch, greenwich_angle


def test_the_moon_of_the_published_example():
    # Meeus 1998, example 47.a: 1992 April 12, 0h TD; TD - UTC = 58.184 s.
    found = ephemeris(Epoch.from_utc(1992, 4, 11, 23, 59, 1.816), np.zeros(1))
    assert np.degrees(found.moon_right_ascension[0]) == pytest.approx(134.688470, abs=5e-4)
    assert np.degrees(found.moon_declination[0]) == pytest.approx(13.768368, abs=5e-4)
    assert found.moon_distance[0] == pytest.approx(368409.7e3, abs=2e3)


def test_the_published_session():
    found = ephemeris(Epoch.from_iso("2001-01-18T04:54:15"), np.zeros(1))
    # Penkov et al. 2009, section 3.6: 300.265, -20.528 deg, Greenwich 191.27 deg, by formulas good to 0.01 deg, and
    # Greenwich by a constant day from 1994.
    assert np.degrees(found.sun_right_ascension[0]) == pytest.approx(300.265, abs=0.01)
    assert np.degrees(found.sun_declination[0]) == pytest.approx(-20.528, abs=0.005)
    assert np.degrees(found.greenwich_angle[0]) == pytest.approx(191.27, abs=0.05)


@pytest.mark.parametrize("step", [64.0, 86400.0])
def test_many_instants_are_those_one_by_one(step):
    epoch, t_s = Epoch.from_iso("2015-06-30T12:00:00"), step * np.arange(200)
    found = ephemeris(epoch, t_s)
    moon, _ = apparent_moon(epoch, t_s)
    for k in (0, 7, 113, 199):
        alone = epoch.shifted(float(t_s[k]))
        # Through the leap second of that day.
        assert found.greenwich_angle[k] == pytest.approx(greenwich_angle(alone), abs=2e-9)
        one = ephemeris(alone, np.zeros(1))
        assert found.sun_right_ascension[k] == pytest.approx(one.sun_right_ascension[0], abs=1e-9)
        assert found.moon_declination[k] == pytest.approx(one.moon_declination[0], abs=1e-9)
        assert moon[k, 2] == pytest.approx(np.sin(one.moon_declination[0]), abs=1e-9)
        np.testing.assert_allclose(dcms_eci_from_gcrf(epoch, t_s)[k], dcm_eci_from_gcrf(alone), atol=1e-9)


def test_an_eclipse_of_the_sun():
    """2017-08-21, greatest eclipse 18:25:32 UT, gamma 0.4367: Sun and Moon are 0.44 Earth radii apart there."""
    found = ephemeris(Epoch.from_iso("2017-08-21T18:25:32"), np.zeros(1))
    apart = erfa.seps(
        found.sun_right_ascension[0],
        found.sun_declination[0],
        found.moon_right_ascension[0],
        found.moon_declination[0],
    )
    miss = found.moon_distance[0] * np.sin(apart) / 6378137.0
    # The shadow's axis does not start at the Moon's distance but runs on to the Earth: 0.25 % more.
    assert miss == pytest.approx(0.4367, abs=0.005)
