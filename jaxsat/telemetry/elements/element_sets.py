"""Files of NORAD mean elements: two- and three-line element sets, and orbit mean-elements messages (OMM)."""

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sgp4.alpha5 import from_alpha5
from sgp4.api import SGP4_ERRORS, Satrec

from jaxsat.environment.orbit import elements_epoch
from jaxsat.errors import InputError
from jaxsat.files.text_file import hidden_character, read_small_file
from jaxsat.telemetry.elements.omm import OmmRecord, satellite_from_omm
from jaxsat.telemetry.elements.omm_formats import looks_like_omm, read_omm_records
from jaxsat.telemetry.elements.tle_lines import LENGTH, check_tle_lines
from jaxsat.time import Epoch

MAX_FILE_BYTES = 64 * 2**20
"""The whole catalogue of 2025 as OMM in XML has about 50 MB."""
KIND = "TLE or OMM"

# Column 63: blank, 0 and 2 are SGP4; 4 is SGP4-XP, whose elements SGP4 misreads (CCSDS 502.0-B-3, table 4-3).
_SGP4_TYPES = " 02"


@dataclass(frozen=True)
class ElementSet:
    """Mean elements of one satellite at one epoch, ready for `jaxsat.environment.sgp4_orbit`."""

    name: str
    """As in the file, empty where it gives none."""
    catalog_number: int
    """NORAD number, 0 where the file gives none."""
    satellite: Satrec
    """The elements as SGP4 takes them."""
    row: int | None
    """Line of the file on which the set begins, from 1; None in JSON."""

    @property
    def epoch(self) -> Epoch:
        """Instant of the elements."""
        return elements_epoch(self.satellite)


def read_element_sets(path: str | Path) -> list[ElementSet]:
    """Reads every element set of a file in its order: TLE with or without names, or OMM as XML, KVN, JSON or CSV.

    The format is recognised by the contents. Raises `InputError` with file, row and field for anything damaged: a wrong
    checksum, a letter among digits, a value out of range, a field missing or given twice, elements of another theory
    than SGP4, elements that SGP4 refuses at their own epoch.
    """
    path = Path(path)
    data = read_small_file(path, limit_bytes=MAX_FILE_BYTES, kind=KIND)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"byte 0x{data[error.start]:02x} is not UTF-8 text", file=path, row=row) from None
    if not text.strip():
        raise InputError(f"file is empty; expected a {KIND} file", file=path)
    if looks_like_omm(text):
        return [_from_omm(record, path) for record in read_omm_records(text, path)]
    return _from_tle(text, path)


def nearest_element_set(sets: Sequence[ElementSet], epoch: Epoch) -> ElementSet:
    """The element set whose own epoch is nearest; ValueError where there is none."""
    if not sets:
        raise ValueError("sets must hold at least one element set, got none")
    return min(sets, key=lambda one: abs(one.epoch.seconds_since(epoch)))


def _from_omm(record: OmmRecord, path: Path) -> ElementSet:
    satellite, name, number = satellite_from_omm(record)
    _check_start(satellite, path, record.row)
    return ElementSet(name, number, satellite, record.row)


def _from_tle(text: str, path: Path) -> list[ElementSet]:
    lines = [(row, line.rstrip()) for row, line in enumerate(text.split("\n"), 1) if line.strip() and line[0] != "#"]
    sets, k = [], 0
    while k < len(lines):
        name = ""
        # A name may itself begin with a digit and a blank: what follows it decides.
        if not _begins_set(lines, k) and (not lines[k][1].startswith(("1 ", "2 ")) or _begins_set(lines, k + 1)):
            row, line = lines[k]
            if line.lstrip().startswith(("1 ", "2 ")) and len(line.lstrip()) == LENGTH:
                raise InputError("a blank stands in front of the line", file=path, row=row, field="TLE line")
            if k > 0 and k + 1 == len(lines):
                reason = f"no element set follows {line[:24]!r}; the trailer of a bulletin has to be taken out"
                raise InputError(reason, file=path, row=row)
            name, k = line.removeprefix("0 ").strip(), k + 1
            if hidden := hidden_character(name):
                raise InputError(f"{hidden} has no place in a name", file=path, row=row, field="TLE name")
        sets.append(_one_tle(lines[k : k + 2], name, path, lines[min(k, len(lines) - 1)][0]))
        k += 2
    return sets


def _begins_set(lines: list[tuple[int, str]], k: int) -> bool:
    return k + 1 < len(lines) and lines[k][1].startswith("1 ") and lines[k + 1][1].startswith("2 ")


def _one_tle(rows: list[tuple[int, str]], name: str, path: Path, row: int) -> ElementSet:
    for number in (1, 2):
        at, found = rows[number - 1] if number <= len(rows) else (row, "the end of the file")
        if not found.startswith(f"{number} "):
            reason = f"expected a line that begins with '{number} ', found {found[:24]!r}"
            raise InputError(reason, file=path, row=at, field=f"TLE line {number}")
    (first_row, first), (second_row, second) = rows
    if second_row != first_row + 1:
        reason = "a blank line or a comment stands within the set"
        raise InputError(reason, file=path, row=first_row + 1, field="TLE line 2")
    check_tle_lines((first, second), file=path, first_row=first_row)
    _check_tle_values(first, second, path, first_row)
    satellite = Satrec.twoline2rv(first, second)
    _check_start(satellite, path, first_row)
    return ElementSet(name, from_alpha5(first[2:7].replace(" ", "0")), satellite, first_row)


def _check_tle_values(first: str, second: str, path: Path, row: int) -> None:
    """Refuses values that fit the layout and the checksum and still are none."""
    # Two digits of the year: 1957 to 2056.
    year = int(first[18:20])
    year += 1900 if year >= 57 else 2000
    days = (datetime.date(year + 1, 1, 1) - datetime.date(year, 1, 1)).days + 1.0
    checks = (
        (row, "epoch", f"day of {year} from 1 to below {days:g}", first[20:32], lambda x: 1.0 <= x < days),
        (row, "epoch", "a year from 1960 on", str(year), lambda x: x >= 1960),
        (row + 1, "inclination", "0 to 180 deg", second[8:16], lambda x: x <= 180.0),
        (row + 1, "right ascension of the node", "0 to 360 deg", second[17:25], lambda x: x <= 360.0),
        (row + 1, "argument of perigee", "0 to 360 deg", second[34:42], lambda x: x <= 360.0),
        (row + 1, "mean anomaly", "0 to 360 deg", second[43:51], lambda x: x <= 360.0),
        (row + 1, "mean motion", "above 0 to 20 turns a day", second[52:63], lambda x: 0.0 < x <= 20.0),
    )
    for at, name, expected, found, accepted in checks:
        if not accepted(float(found)):
            reason = f"expected {expected}, found {found.strip()}"
            raise InputError(reason, file=path, row=at, field=f"TLE {name}")
    if first[2] in "IO":
        reason = f"expected a digit or a letter other than I and O first, found {first[2:7]!r}"
        raise InputError(reason, file=path, row=row, field="TLE satellite number")
    if first[62] not in _SGP4_TYPES:
        reason = f"expected 0 or 2 (SGP4), found {first[62]}: elements of another theory"
        raise InputError(reason, file=path, row=row, field="TLE ephemeris type")


def _check_start(satellite: Satrec, path: Path, row: int | None) -> None:
    code, position, velocity = satellite.sgp4_tsince(0.0)
    if code != 0 or not all(map(math.isfinite, (*position, *velocity))):
        reason = f"SGP4 refuses the elements at their own epoch: {SGP4_ERRORS.get(code, 'no finite motion')}"
        raise InputError(reason, file=path, row=row)
