"""Time scales: published instants, leap seconds, refusals."""

import math

import erfa
import numpy as np
import pytest

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.time import Epoch, equinox_difference, greenwich_angle, greenwich_angles

MUNIN = Epoch.from_utc(2001, 1, 18, 4, 54, 15)


def test_epoch_of_table_1():
    assert MUNIN.iso() == "2001-01-18T04:54:15.000"
    # 17 days and 4 h 54 m 15 s of a year of 365 days.
    assert MUNIN.decimal_year() == pytest.approx(2001 + (17 + 17655 / 86400) / 365, abs=1e-12)
    # TT - UTC = 32.184 s + 32 leap seconds in 2001.
    assert (sum(MUNIN.tt()) - (MUNIN.utc1 + MUNIN.utc2)) * 86400 == pytest.approx(64.184, abs=1e-4)


def test_greenwich_mean_sidereal_time_of_the_almanac():
    # Meeus 1998, example 12.a: 1987 April 10, 0h UT, apparent sidereal time 13h 10m 46.1351s.
    angle = greenwich_angle(Epoch.from_utc(1987, 4, 10))
    assert math.degrees(angle) == pytest.approx((13 + 10 / 60 + 46.1351 / 3600) * 15, abs=2e-5)


def test_shift_counts_leap_seconds():
    before = Epoch.from_utc(2016, 12, 31, 23, 59, 59)
    assert before.shifted(1.0).iso() == "2016-12-31T23:59:60.000"
    assert before.shifted(2.0).iso() == "2017-01-01T00:00:00.000"
    assert Epoch.from_utc(2017, 1, 1).seconds_since(before) == pytest.approx(2.0, abs=1e-6)
    assert Epoch.from_utc(2016, 12, 31, 23, 59, 60.5).iso(1) == "2016-12-31T23:59:60.5"


def test_shift_and_difference_are_inverse():
    assert MUNIN.shifted(4500.25).seconds_since(MUNIN) == pytest.approx(4500.25, abs=1e-6)
    assert MUNIN.shifted(-86400.0).iso() == "2001-01-17T04:54:15.000"


@pytest.mark.parametrize("seconds", [math.nan, math.inf, -math.inf, 1e300, 1e10, -2e9])
def test_shift_out_of_all_years_is_refused(seconds):
    with pytest.raises(ValueError, match=r"^seconds must lead to an epoch in 1960..2200, got"):
        MUNIN.shifted(seconds)


def test_far_future_keeps_the_last_leap_second_silently():
    # Warnings are errors here: a date past ERFA's table must not raise one.
    epoch = Epoch.from_utc(2100, 6, 1, 12)
    assert epoch.iso(0) == "2100-06-01T12:00:00"
    assert epoch.shifted(60.0).seconds_since(epoch) == pytest.approx(60.0, abs=1e-5)
    assert 0.0 <= greenwich_angle(epoch) < 2 * math.pi


@pytest.mark.parametrize(
    "fields, named",
    [
        ((2001, 13, 1), "month"),
        ((2001, 2, 29), "day"),
        ((2001, 1, 0), "day"),
        ((2001, 1, 1, 24), "hour"),
        ((2001, 1, 1, 0, 60), "minute"),
        ((2001, 1, 1, 0, 0, 60), "second"),
        ((2001, 12, 31, 23, 59, 60), "second"),
        ((2016, 12, 31, 23, 59, 61), "second"),
        ((2016, 12, 31, 22, 59, 60), "second"),
        ((2001, 1, 1, 0, 0, -0.5), "second"),
        ((2001, 1, 1, 0, 0, math.nan), "second"),
        ((1959, 12, 31), "year"),
        ((2201, 1, 1), "year"),
    ],
)
def test_refuses_what_is_no_utc(fields, named):
    with pytest.raises(ValueError, match=f"^{named} must"):
        Epoch.from_utc(*fields)


def test_second_60_on_a_real_leap_second_of_june():
    assert Epoch.from_utc(2015, 6, 30, 23, 59, 60).iso(0) == "2015-06-30T23:59:60"


def test_centuries_of_the_almanac():
    # Meeus 1998, example 25.a: 1992 October 13, 0h TD is T = -0.072183436; TD - UTC = 59.184 s.
    epoch = Epoch.from_utc(1992, 10, 12, 23, 59, 0.816)
    assert epoch.tt_centuries() == pytest.approx(-0.072183436, abs=5e-10)


def test_ut1_moves_greenwich():
    # Vallado 2013, example 3-15: apparent sidereal time by the theories of 1976-1982, within 0.05" of those of 2006.
    epoch = Epoch.from_utc(2004, 4, 6, 7, 51, 28.386009)
    assert math.degrees(greenwich_angle(epoch, -0.4399619)) == pytest.approx(312.8067654, abs=2e-5)
    moved = greenwich_angle(epoch, -0.4399619) - greenwich_angle(epoch)
    # The angle of half a second is 3e-5 rad; nutation moves by 5e-12 rad in it.
    assert moved == pytest.approx(-0.4399619 * EARTH_ROTATION_RATE, abs=1e-11)
    for bad in (1.0, -440.0, math.nan):
        with pytest.raises(ValueError, match="^ut1_minus_utc must"):
            greenwich_angle(epoch, bad)


def test_greenwich_runs_on_through_a_leap_second():
    epoch = Epoch.from_utc(2016, 12, 31, 12)
    t_s = np.array([-7200.0, 0.0, 43199.0, 43200.0, 43201.0, 86400.0])
    angles = greenwich_angles(epoch, t_s, 0.3)
    assert angles[1] == pytest.approx(greenwich_angle(epoch, 0.3), abs=1e-12)
    # Uniform to 1e-6 rad a day by nutation; one second of UTC left in or out would be 7e-5 rad.
    away = (angles - angles[1] - EARTH_ROTATION_RATE * t_s + math.pi) % (2 * math.pi) - math.pi
    assert np.max(np.abs(away)) < 1e-6
    # After it UT1 - UTC is one second more.
    later = greenwich_angle(epoch.shifted(86401.0), 0.6)
    assert later == pytest.approx(greenwich_angles(epoch, np.array([86401.0]), -0.4)[0], abs=1e-10)


def test_equinox_difference():
    for year in (1995, 2004, 2020):
        epoch = Epoch.from_utc(year, 4, 6, 7, 51, 28.386009)
        # The equation of the equinoxes of 1994 on the precession of 1976: 0.3" a century of difference.
        assert equinox_difference(epoch) == pytest.approx(float(erfa.eqeq94(*epoch.tt())), abs=math.radians(0.1 / 3600))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2001-01-18T04:54:15", "2001-01-18T04:54:15.000"),
        ("2001-018T04:54:15.2504Z", "2001-01-18T04:54:15.250"),
        ("2000-366T23:59:59.9996", "2001-01-01T00:00:00.000"),
        ("2016-12-31T23:59:60.5", "2016-12-31T23:59:60.500"),
    ],
)
def test_instants_are_read(text, expected):
    assert Epoch.from_iso(text).iso(3) == expected


@pytest.mark.parametrize(
    "text",
    [
        *("2001-13-01T00:00:00", "2001-00-01T00:00:00", "2001-366T00:00:00", "2001-000T00:00:00"),
        *("2001-01-18T24:00:00", "2001-01-18T23:59:60", "2001-01-18T04:54:15+03:00", "2001-01-18 04:54:15"),
        *("2001-01-18", "2001-1-18T04:54:15", "2001-01-18T04:54:1_5", "\u0662001-01-18T04:54:15", "nan", ""),
        *("2001-01-18T04:54:-5", "2001-01-18T04:54:15.", "1959-01-01T00:00:00", "2001-01-18T04:54:15\n"),
    ],
)
def test_instants_of_another_form_are_refused(text):
    with pytest.raises(ValueError):
        Epoch.from_iso(text)


def test_many_instants_at_once_pass_a_leap_second():
    start = Epoch.from_utc(2016, 12, 31, 23, 59, 58)
    t_s = np.array([0.0, 2.25, 3.0, 86403.0])
    texts = start.iso_texts(t_s, 2)
    assert texts == [
        "2016-12-31T23:59:58.00",
        "2016-12-31T23:59:60.25",
        "2017-01-01T00:00:00.00",
        "2017-01-02T00:00:00.00",
    ]
    assert texts == [start.shifted(float(t)).iso(2) for t in t_s]


def test_clock_steps_are_days_of_any_length():
    start = Epoch.from_iso("2016-12-30T12:00:00")
    assert start.iso_texts(start.clock_steps(86400, 4), 0)[-1] == "2017-01-02T12:00:00"
    np.testing.assert_allclose(np.diff(start.clock_steps(86400, 4)), [86400, 86401, 86400], atol=1e-4)
