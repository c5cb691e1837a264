"""Instants in UTC and the Greenwich angle: the plain NumPy edge of the simulator, on top of ERFA."""

import math
import warnings
from dataclasses import dataclass

import erfa

SECONDS_PER_DAY = 86400.0
_FIRST_YEAR, _LAST_YEAR = 1960, 2200


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

    def iso(self, digits: int = 3) -> str:
        """Return the UTC instant as text, `2001-01-18T04:54:15.000`, rounded to `digits` decimals of a second."""
        with _undoubting():
            year, month, day, clock = erfa.d2dtf(b"UTC", digits, self.utc1, self.utc2)
        hour, minute, second, fraction = (int(clock[name]) for name in ("h", "m", "s", "f"))
        text = f"{int(year):04d}-{int(month):02d}-{int(day):02d}T{hour:02d}:{minute:02d}:{second:02d}"
        return f"{text}.{fraction:0{digits}d}" if digits > 0 else text

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

    def shifted(self, seconds: int | float) -> "Epoch":
        """Return the epoch `seconds` SI seconds later, leap seconds counted."""
        tai1, tai2 = self.tai()
        with _undoubting():
            return Epoch(*map(float, erfa.taiutc(tai1, tai2 + seconds / SECONDS_PER_DAY)))

    def seconds_since(self, other: "Epoch") -> float:
        """Return the SI seconds elapsed from `other` to this epoch, leap seconds counted."""
        a, b = self.tai(), other.tai()
        return ((a[0] - b[0]) + (a[1] - b[1])) * SECONDS_PER_DAY


def greenwich_angle(epoch: Epoch) -> float:
    """Return Greenwich apparent sidereal time [rad, 0..2 pi): the angle from the true equinox of date to Greenwich.

    IAU 2006/2000A (Capitaine et al. 2003; ERFA gst06a). UT1 is taken as UTC, which differs from it by less than
    0.9 s: an error below 0.004 deg in longitude.
    """
    return float(erfa.gst06a(epoch.utc1, epoch.utc2, *epoch.tt())) % (2.0 * math.pi)


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
