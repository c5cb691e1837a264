"""Fields of an orbit mean-elements message (CCSDS 502.0-B) checked and made into SGP4's elements."""

import datetime
import difflib
import functools
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

from sgp4.api import WGS72, Satrec

from jaxsat.errors import InputError
from jaxsat.files.text_file import hidden_character
from jaxsat.time import Epoch

_WHOLE = re.compile("[0-9]+")
_DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_EPOCH = re.compile(r"([0-9]{4})-(?:([0-9]{2})-([0-9]{2})|([0-9]{3}))T([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]*)?)Z?")
_SGP4_DAY_0 = datetime.date(1949, 12, 31)
_LARGEST_SGP4_NUMBER = 339999
# Name: lowest, highest, unit, value where absent (None: required).
_NUMBERS: dict[str, tuple[float, float, str, float | None]] = {
    "MEAN_MOTION": (1e-6, 20.0, "rev/day", None),
    "ECCENTRICITY": (0.0, 1.0 - 1e-9, "", None),
    "INCLINATION": (0.0, 180.0, "deg", None),
    "RA_OF_ASC_NODE": (-360.0, 360.0, "deg", None),
    "ARG_OF_PERICENTER": (-360.0, 360.0, "deg", None),
    "MEAN_ANOMALY": (-360.0, 360.0, "deg", None),
    "BSTAR": (-1e3, 1e3, "1/ER", None),
    "MEAN_MOTION_DOT": (-1e3, 1e3, "rev/day**2", 0.0),
    "MEAN_MOTION_DDOT": (-1e3, 1e3, "rev/day**3", 0.0),
    "NORAD_CAT_ID": (0, 999999999, "", 0.0),
    "EPHEMERIS_TYPE": (0, 9, "", 0.0),
}
VERSIONS = ("2.0", "3.0")
# What SGP4 elements are; a message may leave these out, but not say otherwise.
_WORDS = {
    "CCSDS_OMM_VERS": VERSIONS,
    "CENTER_NAME": ("EARTH",),
    "REF_FRAME": ("TEME",),
    "TIME_SYSTEM": ("UTC",),
    # TLE: so in the samples of the NDM/XML set, whose comment says SGP4.
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4", "TLE"),
    "EPHEMERIS_TYPE": ("0", "2"),
}
_READ = (*_NUMBERS, *_WORDS, "EPOCH", "OBJECT_NAME", "OBJECT_ID")
_MOST_FIELDS = 500
"""Of a message: tables of catalogues have some sixty."""


@dataclass
class OmmRecord:
    """Fields of one message by name, as text, each with its row and its stated unit."""

    file: Path
    row: int | None
    """Line on which the message begins, from 1; None in JSON."""
    number: int
    """Place of the message in its file, from 1."""
    fields: dict[str, tuple[str, int | None, str]] = field(default_factory=dict)
    """(text, row, unit) by name."""

    def add(self, name: str, text: str, row: int | None = None, unit: str = "") -> None:
        """Takes up a field; raises `InputError` where it is there already, or is one that is read, but misspelt."""
        if (hidden := hidden_character(name + text.strip())) or len(self.fields) >= _MOST_FIELDS:
            reason = f"{hidden} has no place here" if hidden else f"is beyond {_MOST_FIELDS} fields of one message"
        elif meant := _meant(name):
            reason = f"is not known; did you mean {meant}?"
        else:
            reason = "is given twice in one message" if name in self.fields else ""
        # Of two rows the later one is the one to correct.
        self.fields[name] = (text.strip(), row, unit)
        if reason:
            raise self.error(name, reason)

    def error(self, name: str, reason: str) -> InputError:
        """The error that says what is wrong with a field; with the message's number where rows are not known."""
        _, row, _ = self.fields.get(name, ("", self.row, ""))
        label = f"OMM {name[:40]}" if row is not None else f"OMM {self.number}: {name[:40]}"
        return InputError(reason, file=self.file, row=row, field=label)


@functools.lru_cache(maxsize=4096)
def _meant(name: str) -> str:
    """The field that a misspelt name is near to; empty for those that are read, and for all others."""
    close = [] if name in _READ else difflib.get_close_matches(name.upper(), _READ, n=1, cutoff=0.9)
    return close[0] if close else ""


def satellite_from_omm(record: OmmRecord) -> tuple[Satrec, str, int]:
    """SGP4's elements, name and catalogue number of a message; `InputError` naming the field that is wrong."""
    for name, accepted in _WORDS.items():
        text, _, _ = record.fields.get(name, ("", None, ""))
        if text and text.upper() not in accepted:
            raise record.error(name, f"expected {' or '.join(accepted)}, as SGP4 elements have, found {text[:24]!r}")
    values = {name: _number(record, name) for name in _NUMBERS}
    number = int(values["NORAD_CAT_ID"])
    satellite = Satrec()
    satellite.sgp4init(
        WGS72,
        "i",
        # SGP4's own field is narrower than the catalogue; the number plays no part in the motion.
        number if number <= _LARGEST_SGP4_NUMBER else 0,
        _epoch_days(record),
        values["BSTAR"],
        values["MEAN_MOTION_DOT"] * 2.0 * math.pi / 1440.0**2,
        values["MEAN_MOTION_DDOT"] * 2.0 * math.pi / 1440.0**3,
        values["ECCENTRICITY"],
        math.radians(values["ARG_OF_PERICENTER"]),
        math.radians(values["INCLINATION"]),
        math.radians(values["MEAN_ANOMALY"]),
        values["MEAN_MOTION"] * 2.0 * math.pi / 1440.0,
        math.radians(values["RA_OF_ASC_NODE"]),
    )
    return satellite, record.fields.get("OBJECT_NAME", ("",))[0], number


def _number(record: OmmRecord, name: str) -> float:
    low, high, unit, default = _NUMBERS[name]
    text, _, stated = record.fields.get(name, ("", None, ""))
    if text == "":
        if default is None:
            raise record.error(name, "is missing")
        return default
    if stated not in ("", unit):
        raise record.error(name, f"expected the unit {unit or '(none)'}, found {stated[:24]!r}")
    pattern, kind = (_WHOLE, "a whole number") if isinstance(low, int) else (_DECIMAL, "a plain decimal number")
    if not pattern.fullmatch(text):
        raise record.error(name, f"expected {kind}, found {text[:24]!r}")
    if not low <= float(text) <= high:
        raise record.error(name, f"expected {low:g} to {high:g}, found {text[:24]}")
    return float(text)


def _epoch_days(record: OmmRecord) -> float:
    """The epoch as SGP4 counts it, days of 86400 s since 1949-12-31 0h UTC."""
    text, _, _ = record.fields.get("EPOCH", ("", None, ""))
    match = _EPOCH.fullmatch(text)
    if match is None:
        raise record.error("EPOCH", f"expected a UTC instant such as 2020-12-31T20:26:51.999, found {text[:32]!r}")
    year, hour, minute, second = int(match[1]), int(match[5]), int(match[6]), float(match[7])
    try:
        if match[4] is None:
            date = datetime.date(year, int(match[2]), int(match[3]))
        else:
            date = datetime.date(year, 1, 1) + datetime.timedelta(days=int(match[4]) - 1)
            if date.year != year:
                raise ValueError(f"expected a day of {year}, found {match[4]}")
        Epoch.from_utc(date.year, date.month, date.day, hour, minute)
    except ValueError as error:
        raise record.error("EPOCH", f"{text}: {error}") from None
    if second >= 60.0:
        raise record.error("EPOCH", f"expected seconds below 60, found {text}")
    return (date - _SGP4_DAY_0).days + (3600 * hour + 60 * minute + second) / 86400.0
