"""Stamps of a table as instants: ISO with a time zone, Unix seconds, or seconds since a given epoch."""

import re
from pathlib import Path

import erfa
import numpy as np
from jaxtyping import Float

from jaxsat.errors import InputError
from jaxsat.satellites.sections.session import TimeSettings
from jaxsat.telemetry.table.cells import numbers
from jaxsat.telemetry.table.raw import RawTable
from jaxsat.time import SECONDS_PER_DAY, Epoch

_ISO = re.compile(
    r"([0-9]{4}-[0-9]{2}-[0-9]{2})[T ]([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]{1,12})?)(Z|[+-][0-9]{2}:?[0-9]{2}|)"
)
_UNIX_0 = 2440587.5
_FIRST, _LAST = -315619200.0, 7258118400.0
_SCALE = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_DECIMALS = 9
_ODD, _ODD_S, _MOST_ODD = 0.02, 1.5, 3
"""Of the usual interval, and seconds, by which an interval must be off a multiple of it to be odd; of more such ones
the stamps are not regular."""

Instants = tuple[np.ndarray, np.ndarray]
"""TAI as two-part Julian dates [rows]; NaN where a row has no stamp."""


def instants(table: RawTable, settings: TimeSettings) -> Instants:
    """Returns the instant of each row, the clock's offset taken off.

    Raises `InputError` with row and column for a stamp that is none, one of a clock that nobody names, and one outside
    the years 1960 to 2199.
    """
    if settings.form == "iso":
        found = _from_iso(table, settings)
    else:
        seconds = numbers(table, settings.column) * _SCALE[settings.unit]
        found = (_from_unix if settings.form == "unix" else _after)(table, settings, seconds)
    return found[0], found[1] - settings.offset_s / SECONDS_PER_DAY


def seconds_after(found: Instants, epoch: tuple[float, float]) -> np.ndarray:
    """Seconds from an instant to others, to the nanosecond."""
    days = (found[0] - epoch[0]) + (found[1] - epoch[1])
    return np.round(days * SECONDS_PER_DAY, _DECIMALS)


def as_epoch(tai: tuple[float, float]) -> Epoch:
    """The epoch of an instant of TAI."""
    return Epoch(*map(float, erfa.taiutc(*tai)))


def _after(table: RawTable, settings: TimeSettings, seconds: np.ndarray) -> Instants:
    assert settings.epoch is not None
    day, part = Epoch.from_iso(settings.epoch).tai()
    unix = ((day - _UNIX_0) + part) * SECONDS_PER_DAY + seconds
    wrong = np.flatnonzero((unix < _FIRST) | (unix >= _LAST))
    if wrong.size:
        reason = f"{seconds[wrong[0]]:.15g} s after {settings.epoch} is outside the years 1960 to 2199"
        raise InputError(reason, file=table.path, row=int(table.rows[wrong[0]]), field=settings.column)
    return np.where(np.isnan(seconds), np.nan, day), part + seconds / SECONDS_PER_DAY


def _from_unix(table: RawTable, settings: TimeSettings, seconds: np.ndarray) -> Instants:
    wrong = np.flatnonzero((seconds < _FIRST) | (seconds >= _LAST))
    if wrong.size:
        reason = f"expected Unix seconds from 1960 to 2199, found {seconds[wrong[0]]:.15g}; is time.unit ms, us or ns?"
        raise InputError(reason, file=table.path, row=int(table.rows[wrong[0]]), field=settings.column)
    days, clock = np.divmod(seconds, SECONDS_PER_DAY)
    return _tai(_UNIX_0 + days, clock)


def _tai(midnight: np.ndarray, clock: np.ndarray) -> Instants:
    """TAI of midnights (UTC, Julian dates) and seconds of the clock after them, also within a leap second."""
    known = np.isfinite(midnight) & np.isfinite(clock)
    days = np.unique(midnight[known])
    starts = np.array([Epoch(day, 0.0).tai() for day in days]).reshape(-1, 2)
    place = np.searchsorted(days, midnight[known])
    first, second = np.full(midnight.shape, np.nan), np.full(midnight.shape, np.nan)
    first[known], second[known] = starts[place, 0], starts[place, 1] + clock[known] / SECONDS_PER_DAY
    return first, second


def _from_iso(table: RawTable, settings: TimeSettings) -> Instants:
    cells = table.column(settings.column)
    if isinstance(cells, np.ndarray):
        if cells.dtype.kind != "M":
            reason = 'expected ISO instants, found numbers; is time.form "unix" or "seconds"?'
            raise InputError(reason, file=table.path, field=settings.column)
        nanoseconds = cells.astype("int64")
        whole, rest = np.divmod(nanoseconds, 86400 * 10**9)
        known = ~np.isnat(cells)
        return _tai(np.where(known, _UNIX_0 + whole, np.nan), np.where(known, rest * 1e-9, np.nan))
    midnight, clock = np.full(len(cells), np.nan), np.full(len(cells), np.nan)
    days: dict[str, float] = {}
    for place, cell in enumerate(cells):
        if not cell:
            continue
        match = _ISO.fullmatch(cell)
        if match is None:
            raise _no_instant(cell, table.path, int(table.rows[place]), settings.column)
        date, hour, minute, second, zone = match.groups()
        zone = zone or settings.zone
        if not zone:
            reason = (
                f'{cell!r} names no time zone; write Z or an offset behind it, or time.zone = "UTC" (or "+02:00") '
                "in the satellite file"
            )
            raise InputError(reason, file=table.path, row=int(table.rows[place]), field=settings.column)
        if int(hour) > 23 or int(minute) > 59 or float(second) >= 61.0:
            raise _no_instant(cell, table.path, int(table.rows[place]), settings.column)
        if date not in days or float(second) >= 60.0:
            # Of each date once, and of each leap second: whether there is one.
            moment = f"{date}T{hour}:{minute}:{second}" if float(second) >= 60.0 else f"{date}T00:00:00"
            try:
                found = Epoch.from_iso(moment)
            except ValueError as error:
                raise InputError(
                    str(error), file=table.path, row=int(table.rows[place]), field=settings.column
                ) from None
            days[date] = found.utc1 if float(second) < 60.0 else Epoch.from_iso(f"{date}T00:00:00").utc1
        midnight[place] = days[date]
        clock[place] = int(hour) * 3600.0 + int(minute) * 60.0 + float(second) - _zone_seconds(zone)
    return _tai(midnight, clock)


def _zone_seconds(zone: str) -> float:
    if zone in ("Z", "UTC"):
        return 0.0
    digits = zone[1:].replace(":", "")
    return (1.0 if zone[0] == "+" else -1.0) * (int(digits[:2]) * 3600.0 + int(digits[2:]) * 60.0)


def _no_instant(cell: str, path: Path, row: int, column: str) -> InputError:
    shown = repr(cell if len(cell) <= 40 else cell[:40] + "...")
    return InputError(
        f"expected an instant such as 2020-11-21T20:58:01.250Z, found {shown}", file=path, row=row, field=column
    )


def odd_intervals(t_s: Float[np.ndarray, "n"]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the intervals of regular stamps that are no multiple of the usual one, and what is left of each [s].

    None where more than a few are.
    """
    usual = float(np.median(np.diff(t_s)))
    left = np.remainder(np.diff(t_s) + 0.5 * usual, usual) - 0.5 * usual
    odd = np.flatnonzero(np.abs(left) > max(_ODD * usual, _ODD_S))
    odd = odd if len(odd) <= _MOST_ODD else odd[:0]
    return odd, left[odd]
