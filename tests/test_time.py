"""Time scales: published instants, leap seconds, refusals."""

import math

import pytest

from jaxsat.time import Epoch, greenwich_angle

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
