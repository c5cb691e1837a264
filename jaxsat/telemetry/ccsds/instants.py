"""Instants of CCSDS messages: their written forms, their time systems, and those of a segment in their order."""

import functools
import math
import re
from pathlib import Path

import erfa
import numpy as np

from jaxsat.errors import InputError
from jaxsat.telemetry.ccsds.ndm import Segment
from jaxsat.time import SECONDS_PER_DAY, Epoch

_INSTANT = re.compile(r"([0-9]{4}-(?:[0-9]{2}-[0-9]{2}|[0-9]{3}))T([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]{1,12})?)Z?")
# TAI less the scale [s]. UTC is apart: it has leap seconds.
_AFTER = {"TAI": 0.0, "TT": -32.184, "GPS": 19.0}
_SPANS = ("START_TIME", "USEABLE_START_TIME", "USEABLE_STOP_TIME", "STOP_TIME")
"""In the order of time."""
_SAME_S = 5e-4
"""Instants of one message may be written with different numbers of digits [s]."""


def instants(segment: Segment) -> tuple[Epoch, np.ndarray]:
    """First instant of a segment's data and the seconds of all after it, increasing, within START_TIME and STOP_TIME.

    So are USEABLE_START_TIME and USEABLE_STOP_TIME, in their order.
    TIME_SYSTEM may be UTC, TAI, TT or GPS; the second 60 is taken in UTC within a real leap second alone.
    """
    meta = segment.meta
    system = meta.required("TIME_SYSTEM", ("UTC", *_AFTER))
    for key in ("START_TIME", "STOP_TIME"):
        meta.required(key)
    spans = [key for key in _SPANS if key in meta.values]
    ends = [instant(meta.values[key], system, meta.file, meta.rows[key], key) for key in spans]
    tai = np.array([instant(tokens[0], system, meta.file, row, "instant") for row, tokens in segment.data])
    t = (tai[:, 0] - tai[0, 0]) * SECONDS_PER_DAY + (tai[:, 1] - tai[0, 1])
    after = [(x[0] - tai[0, 0]) * SECONDS_PER_DAY + (x[1] - tai[0, 1]) for x in ends]
    for before, key, gap in zip(spans, spans[1:], np.diff(after), strict=False):
        if gap < -_SAME_S:
            raise meta.error(key, f"{meta.values[key]} is before {before}, {meta.values[before]}")
    low, high = after[0], after[-1]
    for wrong, reason in (
        (np.diff(t, prepend=-np.inf) <= 0.0, "is not after the instant before it"),
        ((t < low - _SAME_S) | (t > high + _SAME_S), "lies outside START_TIME to STOP_TIME"),
    ):
        if wrong.any():
            row, tokens = segment.data[int(np.argmax(wrong))]
            raise InputError(f"{tokens[0]} {reason}", file=meta.file, row=row)
    utc1, utc2 = erfa.taiutc(tai[0, 0], tai[0, 1] / SECONDS_PER_DAY)
    return Epoch(float(utc1), float(utc2)), t


def instant(text: str, system: str, file: Path | None, row: int, name: str) -> tuple[float, float]:
    """TAI of an instant of a message as the Julian date of a day's beginning [days] and the seconds of that day."""
    try:
        match = _INSTANT.fullmatch(text)
        if match is None:
            raise ValueError(f"expected an instant such as 2001-01-18T04:54:15.000, found {text[:40]!r}")
        hour, minute, second = int(match[2]), int(match[3]), float(match[4])
        if hour > 23 or minute > 59 or second >= 60.0:
            # Refused with its reason there, unless it is a leap second.
            Epoch.from_iso(text)
            if system != "UTC":
                raise ValueError(f"{text}: {system} has no leap seconds")
        day, offset = _day(match[1], system)
        seconds = 3600 * hour + 60 * minute + second
    except ValueError as error:
        raise InputError(str(error), file=file, row=row, field=name) from None
    return day, offset + seconds


@functools.lru_cache(maxsize=4096)
def _day(date: str, system: str) -> tuple[float, float]:
    """TAI at 0h of a date in a time system: Julian date [days] and seconds beyond."""
    epoch = Epoch.from_iso(f"{date}T00:00:00")
    tai1, tai2 = epoch.tai()
    midnight = math.floor(epoch.utc1 + epoch.utc2) + 0.5
    if system == "UTC":
        return midnight, ((tai1 - midnight) + tai2) * SECONDS_PER_DAY
    return midnight, _AFTER[system]
