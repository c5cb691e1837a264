"""Checks of the two lines of a NORAD element set: length, fields, checksum, agreement of the two."""

import re
from pathlib import Path

from jaxsat.errors import InputError

LENGTH = 69

# Layout by columns (Hoots & Roehrich 1980, Spacetrack Report 3, appendix). The checksum counts letters as zero, so it
# lets a letter in the epoch pass: the fields are checked on their own.
_NUMBER = r"[0-9A-Z ][0-9 ]{3}[0-9]"
_EXPONENT = r"[ +-][0-9 ]{5}[ +-][0-9]"
_LAYOUT = (
    (
        ("line number", "1 "),
        ("satellite number", _NUMBER),
        ("classification", "[UCS ] "),
        ("international designator", "[0-9 ]{5}[A-Z ]{3} "),
        ("epoch", r"[0-9]{2}[0-9 ]{2}[0-9]\.[0-9]{8} "),
        ("first derivative of mean motion", r"[ +-]\.[0-9]{8} "),
        ("second derivative of mean motion", _EXPONENT + " "),
        ("drag term", _EXPONENT + " "),
        ("ephemeris type", "[0-9 ] "),
        ("element set number", "[0-9 ]{3}[0-9]"),
        ("checksum", "[0-9]"),
    ),
    (
        ("line number", "2 "),
        ("satellite number", _NUMBER + " "),
        ("inclination", r"[0-9 ]{2}[0-9]\.[0-9]{4} "),
        ("right ascension of the node", r"[0-9 ]{2}[0-9]\.[0-9]{4} "),
        ("eccentricity", "[0-9]{7} "),
        ("argument of perigee", r"[0-9 ]{2}[0-9]\.[0-9]{4} "),
        ("mean anomaly", r"[0-9 ]{2}[0-9]\.[0-9]{4} "),
        ("mean motion", r"[0-9 ][0-9]\.[0-9]{8}"),
        ("revolution number", "[0-9 ]{4}[0-9]"),
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
