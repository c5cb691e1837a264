"""The RAW_SUN session file: name, two-line elements, then one row of orbit, currents and magnetometer a sample.

A malformed row ends the reading with an error: nothing is guessed and nothing is skipped, since a damaged file that
passes in silence costs more than one that is looked at. Rows that are well formed but wrong are left to `cleaning`.
Layout: Penkov et al. 2009 (Munin), section 3.1.
"""

import datetime
import hashlib
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL, read_small_file
from jaxsat.telemetry.elements.tle_lines import check_tle_lines
from jaxsat.time import Epoch

MAX_FILE_BYTES = 16 * 2**20
"""A session has a few hundred rows of 173 bytes; this is room for about ninety thousand."""

KIND = "RAW_SUN"
_HEADER_ROWS = 3

# Name, lowest and highest accepted value. The limits only catch what cannot be the quantity at all (shifted columns).
_TIME = (
    ("year", 1972, 2100),
    ("month", 1, 12),
    ("day", 1, 31),
    ("hour", 0, 23),
    ("minute", 0, 59),
    ("second", 0.0, 61.0),
)
_FIELDS = (
    *((f"sample {name}", low, high) for name, low, high in _TIME),
    *((f"reception {name}", low, high) for name, low, high in _TIME),
    *((f"position {axis} [km]", -1e6, 1e6) for axis in "XYZ"),
    *((f"velocity {axis} [km/s]", -100.0, 100.0) for axis in "XYZ"),
    *((f"current {k} [mA]", -1e6, 1e6) for k in range(1, 7)),
    ("sum of currents [mA]", -1e7, 1e7),
    *((f"magnetometer {axis} [uT]", -1e6, 1e6) for axis in ("By", "Bz")),
)
_INTEGER = re.compile(r"[0-9]{1,4}")


@dataclass(frozen=True)
class RawSunFile:
    """A RAW_SUN file as it stands: rows in file order, units and column order of the file, nothing corrected."""

    path: Path
    sha256: str
    """Of the file's bytes."""
    satellite: str
    tle: tuple[str, str]
    row: np.ndarray
    """[rows] line number in the file, from 1."""
    sample_time: np.ndarray
    """[rows 6] UTC year, month, day, hour, minute, second to which the row belongs."""
    reception_time: np.ndarray
    """[rows 6] the same for the reception on the ground."""
    position_eci_km: np.ndarray
    """[rows 3] equatorial of date."""
    velocity_eci_km_s: np.ndarray
    """[rows 3]"""
    currents_mA: np.ndarray
    """[rows 6] in the column order of the file."""
    current_sum_mA: np.ndarray
    """[rows] as telemetered."""
    magnetometer_uT: np.ndarray
    """[rows 2] body y and z; 999.9 = no reading."""


def read_raw_sun(path: str | Path) -> RawSunFile:
    """Reads a RAW_SUN file; line ends may be CR LF or LF, blank lines after the header are passed over.

    Second 60 is accepted only within a real leap second.
    Raises `InputError` with file, row and field for anything malformed: no file, too long (16 MiB), binary, no samples,
    damaged element set, missing or surplus fields, anything that is not a plain finite number, an impossible date or
    hour, and a last row that was cut short.
    """
    path = Path(path)
    data = read_small_file(path, limit_bytes=MAX_FILE_BYTES, kind=KIND)
    lines = _lines(data, path)
    if len(lines) < _HEADER_ROWS:
        reason = f"file ends after {len(lines)} line(s); expected a satellite name and two element lines"
        raise InputError(reason, file=path, row=len(lines))
    tle = (lines[1].rstrip(" "), lines[2].rstrip(" "))
    if not (tle[0].startswith("1 ") or tle[1].startswith("2 ")):
        reason = "no RAW_SUN file, which has an element set in its lines 2 and 3; of any other telemetry `jaxsat init` "
        raise InputError(reason + "drafts the satellite file that `fit` and `check` take", file=path, row=2)
    check_tle_lines(tle, file=path, first_row=2)
    rows = [(number, line) for number, line in enumerate(lines, 1) if number > _HEADER_ROWS and line.strip(" \t")]
    if not rows:
        raise InputError("no samples after the three header lines", file=path, row=len(lines))
    _check_last_row(data, rows, path)
    table = np.array([_parse_row(line, path, number) for number, line in rows], dtype=np.float64)
    return RawSunFile(
        path=path,
        sha256=hashlib.sha256(data).hexdigest(),
        satellite=lines[0].strip(),
        tle=tle,
        row=np.array([number for number, _ in rows]),
        sample_time=table[:, 0:6],
        reception_time=table[:, 6:12],
        position_eci_km=table[:, 12:15],
        velocity_eci_km_s=table[:, 15:18],
        currents_mA=table[:, 18:24],
        current_sum_mA=table[:, 24],
        magnetometer_uT=table[:, 25:27],
    )


def _lines(data: bytes, path: Path) -> list[str]:
    """Splits into lines: ASCII throughout, but for the satellite's name, which may be UTF-8."""
    lines = []
    # A byte-order mark is what some editors leave when a row is corrected by hand.
    for number, line in enumerate(data.removeprefix(b"\xef\xbb\xbf").split(b"\n"), 1):
        try:
            lines.append(line.removesuffix(b"\r").decode("utf-8" if number == 1 else "ascii"))
        except UnicodeDecodeError as error:
            byte = line[error.start]
            reason = f"byte 0x{byte:02x} at column {error.start + 1} is not plain ASCII text"
            raise InputError(reason, file=path, row=number) from None
    if lines[-1] == "":
        lines.pop()
    return lines


def _check_last_row(data: bytes, rows: list[tuple[int, str]], path: Path) -> None:
    """Refuses a last row without line end that is shorter than all others: its last number may have lost digits."""
    number, last = rows[-1]
    others = [len(line) for _, line in rows[:-1]]
    if others and not data.endswith(b"\n") and len(last) < min(others):
        reason = (
            f"row is cut short: {len(last)} characters and no line end, where other rows have {min(others)} or more"
        )
        raise InputError(reason, file=path, row=number)


def _parse_row(line: str, path: Path, row: int) -> list[float]:
    tokens = re.split(r"[ \t]+", line.strip(" \t"))
    if len(tokens) != len(_FIELDS):
        missing = f", from {_FIELDS[len(tokens)][0]!r} on missing" if len(tokens) < len(_FIELDS) else ""
        raise InputError(f"expected {len(_FIELDS)} fields, found {len(tokens)}{missing}", file=path, row=row)
    values = []
    for token, (name, low, high) in zip(tokens, _FIELDS, strict=True):
        integer = isinstance(low, int)
        shown = repr(token if len(token) <= 24 else token[:24] + "...")
        if not (_INTEGER if integer else REAL).fullmatch(token):
            kind = "a whole number" if integer else "a plain decimal number"
            raise InputError(f"expected {kind}, found {shown}", file=path, row=row, field=name)
        value = float(token)
        # Seconds stop short of their limit; not finite: an exponent beyond the range of a double.
        if not (low <= value <= high) or not math.isfinite(value) or (name.endswith("second") and value >= high):
            expected = f"expected {low:g} to {'below ' if name.endswith('second') else ''}{high:g}, found {shown}"
            raise InputError(expected, file=path, row=row, field=name)
        values.append(value)
    for first, name in ((0, "sample"), (6, "reception")):
        _check_calendar(values[first : first + 6], path, row, name)
    return values


def _check_calendar(fields: list[float], path: Path, row: int, name: str) -> None:
    year, month, day, hour, minute = (int(x) for x in fields[:5])
    try:
        datetime.date(year, month, day)
    except ValueError:
        reason = f"expected a day of {year}-{month:02d}, found {day}"
        raise InputError(reason, file=path, row=row, field=f"{name} day") from None
    if fields[5] >= 60.0:
        try:
            Epoch.from_utc(year, month, day, hour, minute, fields[5])
        except ValueError:
            reason = f"expected 0 to below 60 (this minute has no leap second), found {fields[5]:g}"
            raise InputError(reason, file=path, row=row, field=f"{name} second") from None
