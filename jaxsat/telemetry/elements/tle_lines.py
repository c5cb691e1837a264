"""The two lines of a NORAD element set: checks of length, fields, checksum and agreement; lines of given elements."""

import math
import re
from collections.abc import Mapping
from pathlib import Path

from sgp4.api import WGS72, Satrec
from sgp4.exporter import export_tle

from jaxsat.errors import InputError
from jaxsat.time import SECONDS_PER_DAY, Epoch

LENGTH = 69

# Layout by columns (Hoots & Roehrich 1980, Spacetrack Report 3, appendix). The checksum counts letters as zero, so it
# lets a letter in the epoch pass: the fields are checked on their own.
# SGP4 itself reads a blank among digits as it comes: a blank is taken in front of a number alone.


def _padded(width: int) -> str:
    """Pattern of a whole number of up to `width` digits, blanks in front of it."""
    return "(?:" + "|".join(" " * blanks + f"[0-9]{{{width - blanks}}}" for blanks in range(width)) + ")"


_NUMBER = f"(?:[A-Z][0-9]{{4}}|{_padded(5)})"
_DEGREES = _padded(3) + r"\.[0-9]{4} "
_EXPONENT = "[ +-][0-9]{5}[ +-][0-9]"
_LAYOUT = (
    (
        ("line number", "1 "),
        ("satellite number", _NUMBER),
        ("classification", "[UCS ] "),
        ("international designator", "(?:[0-9]{5}(?:[A-Z]{3}|[A-Z]{2} |[A-Z]  |   )| {8}) "),
        ("epoch", "[0-9]{2}" + _padded(3) + r"\.[0-9]{8} "),
        ("first derivative of mean motion", r"[ +-]\.[0-9]{8} "),
        ("second derivative of mean motion", _EXPONENT + " "),
        ("drag term", _EXPONENT + " "),
        ("ephemeris type", "[0-9 ] "),
        ("element set number", _padded(4)),
        ("checksum", "[0-9]"),
    ),
    (
        ("line number", "2 "),
        ("satellite number", _NUMBER + " "),
        ("inclination", _DEGREES),
        ("right ascension of the node", _DEGREES),
        ("eccentricity", _padded(7) + " "),
        ("argument of perigee", _DEGREES),
        ("mean anomaly", _DEGREES),
        ("mean motion", _padded(2) + r"\.[0-9]{8}"),
        ("revolution number", _padded(5)),
        ("checksum", "[0-9]"),
    ),
)


def check_tle_lines(lines: tuple[str, str], *, file: str | Path | None = None, first_row: int = 1) -> None:
    """Raises `InputError` with row and field unless the two lines are a well-formed two-line element set."""
    for line, layout, row in zip(lines, _LAYOUT, (first_row, first_row + 1), strict=True):
        if len(line) != LENGTH:
            reason = f"expected {LENGTH} characters of an element set, found {len(line)}"
            raise InputError(reason, file=file, row=row, field=f"TLE line {row - first_row + 1}")
        start = 0
        for name, pattern in layout:
            match = re.compile(pattern).match(line, start)
            if match is None:
                found = line[start : start + 14]
                reason = f"malformed at column {start + 1}: found {found!r}"
                raise InputError(reason, file=file, row=row, field=f"TLE {name}")
            start = match.end()
        expected = checksum(line)
        if int(line[-1]) != expected:
            reason = f"is {line[-1]}, but the line sums to {expected}: the line is damaged"
            raise InputError(reason, file=file, row=row, field="TLE checksum")
    if lines[0][2:7] != lines[1][2:7]:
        reason = f"differs between the two lines: {lines[0][2:7]!r} and {lines[1][2:7]!r}"
        raise InputError(reason, file=file, row=first_row + 1, field="TLE satellite number")


def checksum(line: str) -> int:
    """Sum of the digits of columns 1-68, minus signs counted as one, modulo ten."""
    return sum(int(c) if c.isdigit() else c == "-" for c in line[: LENGTH - 1]) % 10


def element_lines(elements: Mapping[str, float], epoch: Epoch, *, mu: float) -> tuple[str, str]:
    """Returns the element set with these elements at an epoch, its drag zero and its numbers 99999 and blank.

    Keys are the leaves of `jaxsat.environment.KeplerOrbit`, SI. The elements are written as they are: taken for mean
    ones by SGP4 they place a low satellite some kilometres off. Raises ValueError outside 1957 to 2056, which is what
    two digits of the year can say.
    """
    if not 1957.0 <= epoch.decimal_year() < 2057.0:
        raise ValueError(f"an element set tells years from 1957 to 2056, got {epoch.iso(0)}")
    turn = 2.0 * math.pi
    satellite = Satrec()
    satellite.sgp4init(
        WGS72,
        "i",
        99999,
        epoch.utc1 + epoch.utc2 - _SGP4_DAY_0,
        0.0,
        0.0,
        0.0,
        elements["eccentricity"],
        elements["argument_of_perigee"] % turn,
        elements["inclination"],
        elements["mean_anomaly"] % turn,
        math.sqrt(mu / elements["semi_major_axis"] ** 3) * 60.0,
        elements["raan"] % turn,
    )
    satellite.classification = "U"
    return export_tle(satellite)


_SGP4_DAY_0 = 2433281.5
"""Julian date from which SGP4 counts days, 1949-12-31 0h."""


def international_designator(line: str) -> str:
    """Returns the designator in the first line as messages write it, `2000-075C`; empty where the line has none."""
    match = re.fullmatch(r"([0-9]{2})([0-9]{3})([A-Z]{1,3}) *", line[9:17])
    if match is None:
        return ""
    year = int(match[1])
    return f"{year + (1900 if year >= 57 else 2000)}-{match[2]}{match[3]}"


def line_epoch(line: str) -> Epoch | None:
    """Returns the epoch in the first line; None where it names no day that there is."""
    try:
        year, day = int(line[18:20]), float(line[20:32])
        start = Epoch.from_iso(f"{year + (1900 if year >= 57 else 2000)}-{int(day):03d}T00:00:00")
    except ValueError:
        return None
    return start.shifted((day - int(day)) * SECONDS_PER_DAY)
