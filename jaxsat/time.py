"""Instants in UTC and the Greenwich angle: the plain NumPy edge of the simulator, on top of ERFA."""

import math
import re
import warnings
from dataclasses import dataclass

import erfa
import numpy as np
from jaxtyping import Float

SECONDS_PER_DAY = 86400.0
DAYS_PER_CENTURY = 36525.0
"""Days of a Julian century."""
J2000 = 2451545.0
"""Julian date of the epoch J2000, 2000-01-01T12:00 TT [days]."""
_FIRST_YEAR, _LAST_YEAR = 1960, 2200
_FIRST_DAY, _END_DAY = (sum(erfa.cal2jd(year, 1, 1)) for year in (_FIRST_YEAR, _LAST_YEAR + 1))
# Stricter than a calendar library: ASCII digits alone, two of each, no sign, no offset from UTC.
_ISO = re.compile(
    r"([0-9]{4})-(?:([0-9]{2})-([0-9]{2})|([0-9]{3}))T([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]{1,12})?)Z?"
)


@dataclass(frozen=True)
class Epoch:
    """An instant of UTC, held as ERFA's two-part quasi Julian date [days] (one second is 1/86401 of a leap-second day).

    Years 1960 to 2200; beyond the leap-second table of the installed ERFA the last known TAI - UTC is kept, so a far
    future instant is uncertain by the leap seconds not yet announced.
    """

    utc1: float
    utc2: float

    @classmethod
    def from_utc(
        cls, year: int, month: int, day: int, hour: int = 0, minute: int = 0, second: int | float = 0.0
    ) -> "Epoch":
        """Return the epoch of a calendar date and time; raise ValueError naming the field that is out of range.

        Second 60 is accepted only in the last minute of a day that has a leap second.
        """
        for name, value in (("year", year), ("month", month), ("day", day), ("hour", hour), ("minute", minute)):
            if not value % 1 == 0:
                raise ValueError(f"{name} must be a whole number, got {value}")
        year, month, day, hour, minute = map(int, (year, month, day, hour, minute))
        if not _FIRST_YEAR <= year <= _LAST_YEAR:
            raise ValueError(f"year must be in {_FIRST_YEAR}..{_LAST_YEAR} (UTC begins in 1960), got {year}")
        if not 1 <= month <= 12:
            raise ValueError(f"month must be in 1..12, got {month}")
        if not 1 <= day <= _days_in_month(year, month):
            raise ValueError(f"day must be in 1..{_days_in_month(year, month)} in {year}-{month:02d}, got {day}")
        if not 0 <= hour <= 23:
            raise ValueError(f"hour must be in 0..23, got {hour}")
        if not 0 <= minute <= 59:
            raise ValueError(f"minute must be in 0..59, got {minute}")
        limit = 61.0 if (hour, minute) == (23, 59) and _has_leap_second(year, month, day) else 60.0
        if not 0.0 <= second < limit:
            raise ValueError(f"second must be at least 0 and below {limit:g} at this minute, got {second}")
        with _undoubting():
            return cls(*map(float, erfa.dtf2d(b"UTC", year, month, day, hour, minute, second)))

    @classmethod
    def from_iso(cls, text: str) -> "Epoch":
        """Return the epoch of an ISO 8601 instant of UTC, `2001-01-18T04:54:15.25` or by day of year `2001-018T...`.

        A closing Z is taken, an offset from UTC is not. Raises ValueError, as `from_utc` does, and for any other form.
        """
        match = _ISO.fullmatch(text)
        if match is None:
            shown = repr(text if len(text) <= 40 else text[:40] + "...")
            raise ValueError(f"expected a UTC instant such as 2001-01-18T04:54:15.000, found {shown}")
        year, hour, minute, second = int(match[1]), int(match[5]), int(match[6]), float(match[7])
        try:
            month, day = (int(match[2]), int(match[3])) if match[4] is None else _date_of_day(year, int(match[4]))
            return cls.from_utc(year, month, day, hour, minute, second)
        except ValueError as error:
            raise ValueError(f"{text}: {error}") from None

    def iso(self, digits: int = 3) -> str:
        """Return the UTC instant as text, `2001-01-18T04:54:15.000`, rounded to `digits` decimals of a second."""
        return _iso_texts(self.utc1, np.array([self.utc2]), digits)[0]

    def iso_texts(self, t_s: Float[np.ndarray, "n"], digits: int = 3) -> list[str]:
        """Return `iso` of the instants `t_s` SI seconds later, many at once."""
        tai1, tai2 = self.tai()
        with _undoubting():
            utc1, utc2 = erfa.taiutc(tai1, tai2 + np.asarray(t_s, float) / SECONDS_PER_DAY)
        return _iso_texts(utc1, utc2, digits)

    def decimal_year(self) -> float:
        """Return the year and the elapsed fraction of it (of 365 or 366 days), as used for geomagnetic models."""
        year = int(erfa.jd2cal(self.utc1, self.utc2)[0])
        start, end = sum(erfa.cal2jd(year, 1, 1)), sum(erfa.cal2jd(year + 1, 1, 1))
        return year + ((self.utc1 - start) + self.utc2) / (end - start)

    def tai(self) -> tuple[float, float]:
        """Return International Atomic Time as a two-part Julian date [days]."""
        with _undoubting():
            tai1, tai2 = erfa.utctai(self.utc1, self.utc2)
        return float(tai1), float(tai2)

    def tt(self) -> tuple[float, float]:
        """Return Terrestrial Time as a two-part Julian date [days]."""
        tt1, tt2 = erfa.taitt(*self.tai())
        return float(tt1), float(tt2)

    def tt_centuries(self) -> float:
        """Return Terrestrial Time in Julian centuries since J2000, the argument of the series of Sun and Moon."""
        tt1, tt2 = self.tt()
        return ((tt1 - J2000) + tt2) / DAYS_PER_CENTURY

    def ut1(self, ut1_minus_utc: int | float = 0.0) -> tuple[float, float]:
        """Return Universal Time UT1 as a two-part Julian date [days]; `ut1_minus_utc` [s] is published by the IERS.

        Raises ValueError unless it lies within 1 s of zero, as UT1 - UTC does by definition of UTC.
        """
        if not -1.0 < ut1_minus_utc < 1.0:
            raise ValueError(f"ut1_minus_utc must be within 1 s of zero, got {ut1_minus_utc}")
        with _undoubting():
            ut11, ut12 = erfa.utcut1(self.utc1, self.utc2, ut1_minus_utc)
        return float(ut11), float(ut12)

    def ut1_after(
        self, t_s: Float[np.ndarray, "n"], ut1_minus_utc: int | float = 0.0
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Return UT1 `t_s` SI seconds later, two-part Julian dates [days], with the same UT1 - UTC [s] at all of them.

        So it follows UTC through leap seconds, as UT1 does within 0.9 s: over years that is nearer than running on.
        """
        tai1, tai2 = self.tai()
        with _undoubting():
            utc1, utc2 = erfa.taiutc(tai1, tai2 + np.asarray(t_s, float) / SECONDS_PER_DAY)
            return erfa.utcut1(utc1, utc2, ut1_minus_utc)

    def clock_steps(self, step: int | float, count: int) -> Float[np.ndarray, "count"]:
        """Return SI seconds from the epoch to the same clock time `step` seconds of UTC later, 0 to count - 1 times.

        A day is one day on the clock, leap second or not.
        """
        midnight = math.floor(self.utc1 + self.utc2 - 0.5) + 0.5
        with _undoubting():
            days, clock = np.divmod(self.seconds_since(Epoch(midnight, 0.0)) + step * np.arange(count), SECONDS_PER_DAY)
            later1, later2 = erfa.utctai(midnight + days, np.zeros(count))
        tai1, tai2 = self.tai()
        return ((later1 - tai1) + (later2 - tai2)) * SECONDS_PER_DAY + clock

    def shifted(self, seconds: int | float) -> "Epoch":
        """Return the epoch `seconds` SI seconds later, leap seconds counted.

        Raises ValueError where `seconds` is not finite or leads out of the years of an epoch.
        """
        tai1, tai2 = self.tai()
        later = tai2 + seconds / SECONDS_PER_DAY
        # Of NaN, too, nothing is true.
        if not _FIRST_DAY <= tai1 + later < _END_DAY:
            raise ValueError(f"seconds must lead to an epoch in {_FIRST_YEAR}..{_LAST_YEAR}, got {seconds}")
        with _undoubting():
            return Epoch(*map(float, erfa.taiutc(tai1, later)))

    def seconds_since(self, other: "Epoch") -> float:
        """Return the SI seconds elapsed from `other` to this epoch, leap seconds counted."""
        a, b = self.tai(), other.tai()
        return ((a[0] - b[0]) + (a[1] - b[1])) * SECONDS_PER_DAY


def greenwich_angle(epoch: Epoch, ut1_minus_utc: int | float = 0.0) -> float:
    """Return Greenwich apparent sidereal time [rad, 0..2 pi): the angle from the true equinox of date to Greenwich.

    IAU 2006/2000A (Capitaine et al. 2003; ERFA gst06a). Where UT1 - UTC [s] is not given UT1 is taken as UTC, which
    differs from it by less than 0.9 s: an error below 0.004 deg in longitude.
    """
    return float(erfa.gst06a(*epoch.ut1(ut1_minus_utc), *epoch.tt())) % (2.0 * math.pi)


def greenwich_angles(
    epoch: Epoch, t_s: Float[np.ndarray, "n"], ut1_minus_utc: int | float = 0.0
) -> Float[np.ndarray, "n"]:
    """Return Greenwich apparent sidereal time [rad, 0..2 pi) `t_s` SI seconds after an epoch.

    UT1 - UTC [s] holds at the epoch, from where UT1 runs on at one second a second, leap seconds or not; days that are
    1 ms too long, as many are, make 7e-8 rad a day.
    """
    (ut11, ut12), (tt1, tt2), days = epoch.ut1(ut1_minus_utc), epoch.tt(), np.asarray(t_s, float) / SECONDS_PER_DAY
    return erfa.gst06a(ut11, ut12 + days, tt1, tt2 + days) % (2.0 * math.pi)


def equinox_difference(epoch: Epoch, ut1_minus_utc: int | float = 0.0) -> float:
    """Return the right ascension from the true equinox of date less that from the mean equinox of SGP4 [rad].

    Apparent sidereal time of 2006 less the mean sidereal time of 1982, from which SGP4's frame is counted (Vallado et
    al. 2006, appendix C), so that places over the turning Earth are kept: the equation of the equinoxes, but for the
    precession constants of 1976 and 2006, which differ by 0.3" a century.
    """
    ut1 = epoch.ut1(ut1_minus_utc)
    return math.remainder(float(erfa.gst06a(*ut1, *epoch.tt())) - float(erfa.gmst82(*ut1)), 2.0 * math.pi)


def _iso_texts(utc1, utc2, digits: int) -> list[str]:
    with _undoubting():
        year, month, day, clock = erfa.d2dtf(b"UTC", digits, utc1, utc2)
    columns = (year, month, day, *(clock[name] for name in "hmsf"))
    rows = zip(*(np.atleast_1d(column).tolist() for column in columns), strict=True)
    tail = f".{{:0{digits}d}}" if digits > 0 else ""
    pattern = "{:04d}-{:02d}-{:02d}T{:02d}:{:02d}:{:02d}" + tail
    return [pattern.format(*row) for row in rows]


def _date_of_day(year: int, day: int) -> tuple[int, int]:
    """Month and day of the month of a day of the year, from 1."""
    start, following = (sum(erfa.cal2jd(y, 1, 1)) for y in (year, year + 1))
    if not 1 <= day <= round(following - start):
        raise ValueError(f"day of the year must be in 1..{round(following - start)} in {year}, got {day}")
    _, month, day_of_month, _ = erfa.jd2cal(start, day - 1.0)
    return int(month), int(day_of_month)


def _undoubting() -> warnings.catch_warnings:
    # ERFA says "dubious year" past its leap-second table; Epoch's docstring states what is then assumed.
    return warnings.catch_warnings(action="ignore", category=erfa.ErfaWarning)


def _days_in_month(year: int, month: int) -> int:
    following = (year + 1, 1) if month == 12 else (year, month + 1)
    return round(sum(erfa.cal2jd(*following, 1)) - sum(erfa.cal2jd(year, month, 1)))


def _has_leap_second(year: int, month: int, day: int) -> bool:
    start = erfa.cal2jd(year, month, day)
    next_year, next_month, next_day = (int(x) for x in erfa.jd2cal(start[0], start[1] + 1.0)[:3])
    with _undoubting():
        # Half a second separates a leap second from the slow drift of TAI - UTC before 1972.
        step = erfa.dat(next_year, next_month, next_day, 0.0) - erfa.dat(year, month, day, 0.0)
    return bool(step > 0.5)
