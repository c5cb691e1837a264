"""What attitude and orbit ephemeris messages of CCSDS share in their KEYWORD = VALUE form: header, segments, instants.

CCSDS 502.0-B (orbit) and 504.0-B (attitude). A message that is damaged ends with an error: nothing is guessed.
"""

import functools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import erfa
import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL, read_small_file
from jaxsat.time import SECONDS_PER_DAY, Epoch

MAX_FILE_BYTES = 256 * 2**20
"""Room for about two million lines."""
LONGEST_LINE = 254
"""Characters, what the standards allow."""

_KEY_LINE = re.compile(r"[ \t]*([A-Z0-9_]+)[ \t]*=[ \t]*(.*?)[ \t]*")
_INSTANT = re.compile(r"([0-9]{4}-(?:[0-9]{2}-[0-9]{2}|[0-9]{3}))T([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]{1,12})?)Z?")
# TAI less the scale [s]. UTC is apart: it has leap seconds.
_AFTER = {"TAI": 0.0, "TT": -32.184, "GPS": 19.0}
_SKIPPED = {"COVARIANCE_START": "COVARIANCE_STOP"}


@dataclass
class Block:
    """Keywords of a header or of a segment's metadata, with their lines."""

    file: Path | None
    row: int
    """Line on which it begins, from 1."""
    values: dict[str, str] = field(default_factory=dict)
    rows: dict[str, int] = field(default_factory=dict)

    def error(self, key: str, reason: str) -> InputError:
        """The error that says what is wrong with a keyword."""
        return InputError(reason, file=self.file, row=self.rows.get(key, self.row), field=key)

    def required(self, key: str, accepted: Sequence[str] = ()) -> str:
        """The value of a keyword; `InputError` where it is missing, or none of those accepted (in capitals)."""
        value = self.values.get(key, "")
        if not value:
            raise self.error(key, "is missing")
        if accepted and value.upper() not in accepted:
            raise self.error(key, f"expected {' or '.join(accepted)}, found {value[:40]!r}")
        return value.upper() if accepted else value


@dataclass
class Segment:
    """Metadata of one segment and its lines of data, split at blanks."""

    meta: Block
    data: list[tuple[int, list[str]]] = field(default_factory=list)
    """Line number and its fields."""


def read_message(path: str | Path, *, kind: str, versions: Sequence[str]) -> tuple[Block, list[Segment]]:
    """Header and segments of a message of a `kind`, AEM or OEM; comments and covariances are passed over.

    Raises `InputError` with file and line for anything but ASCII, another kind or version, a keyword given twice or out
    of place, a line too long, blocks that do not close, and a message without data.
    """
    path = Path(path)
    lines = _lines(path, kind)
    header: Block | None = None
    segments: list[Segment] = []
    # Where we are: before the metadata, within it, after it, within data, or within something to pass over.
    place, until = "header", ""
    for row, line in lines:
        word = line.strip(" \t")
        if not word or word.split(None, 1)[0] == "COMMENT":
            continue
        if place == "skipped":
            place = "between" if word == until else place
            continue
        if header is None:
            header = Block(path, row)
            version = f"CCSDS_{kind}_VERS"
            _take(header, word, row, path)
            if version not in header.values:
                raise InputError(f"expected {version} = ..., found {word[:40]!r}", file=path, row=row)
            header.required(version, versions)
        elif word == "META_START" and place in ("header", "between", "data"):
            segments.append(Segment(Block(path, row)))
            place = "meta"
        elif word == "META_STOP" and place == "meta":
            place = "data" if kind == "OEM" else "between"
        elif word == "DATA_START" and kind == "AEM" and place == "between" and segments and not segments[-1].data:
            place = "data"
        elif word == "DATA_STOP" and kind == "AEM" and place == "data":
            place = "between"
        elif word in _SKIPPED and kind == "OEM" and place in ("data", "between"):
            place, until = "skipped", _SKIPPED[word]
        elif place in ("header", "meta"):
            _take(header if place == "header" else segments[-1].meta, word, row, path)
        elif place == "data" and "=" not in word:
            segments[-1].data.append((row, word.split()))
        else:
            raise InputError(f"has no place here: {word[:40]!r}", file=path, row=row)
    last = lines[-1][0] if lines else 1
    if header is None or not segments:
        raise InputError(f"holds no segment of an {kind}", file=path, row=last)
    closed = ("data", "between") if kind == "OEM" else ("between",)
    if place not in closed:
        raise InputError(f"ends within its {'metadata' if place == 'meta' else place}", file=path, row=last)
    for segment in segments:
        if not segment.data:
            raise InputError("a segment without data", file=path, row=segment.meta.row)
    return header, segments


def _lines(path: Path, kind: str) -> list[tuple[int, str]]:
    data = read_small_file(path, limit_bytes=MAX_FILE_BYTES, kind=kind)
    found = []
    for row, raw in enumerate(data.split(b"\n"), 1):
        line = raw.removesuffix(b"\r")
        if len(line) > LONGEST_LINE:
            raise InputError(f"line has {len(line)} characters, expected at most {LONGEST_LINE}", file=path, row=row)
        if not line.isascii():
            raise InputError("is not plain ASCII text", file=path, row=row)
        found.append((row, line.decode("ascii")))
    return found


def _take(block: Block, line: str, row: int, path: Path) -> None:
    match = _KEY_LINE.fullmatch(line)
    if match is None:
        raise InputError(f"expected KEYWORD = VALUE, found {line[:40]!r}", file=path, row=row)
    key = match[1]
    if key in block.values:
        raise InputError(f"is given twice, in line {block.rows[key]} too", file=path, row=row, field=key)
    block.values[key], block.rows[key] = match[2], row


def numbers(segment: Segment, columns: int, optional: int = 0) -> np.ndarray:
    """[lines columns] the numbers behind the instants; a line may have some `optional` ones more, which are checked."""
    file = segment.meta.file
    table = []
    for row, tokens in segment.data:
        if len(tokens) - 1 not in (columns, columns + optional):
            reason = f"expected an instant and {columns} numbers, found {len(tokens)} fields"
            raise InputError(reason, file=file, row=row)
        values = [float(token) if REAL.fullmatch(token) else math.nan for token in tokens[1:]]
        # Not finite: an exponent beyond the range of a double, or no number at all.
        if not all(map(math.isfinite, values)):
            token = next(t for t, value in zip(tokens[1:], values, strict=True) if not math.isfinite(value))
            raise InputError(f"expected a plain decimal number, found {token[:24]!r}", file=file, row=row)
        table.append(values[:columns])
    return np.array(table)


def check_keywords(segment: Segment, known: Sequence[str]) -> None:
    """Raises `InputError` for a keyword of the metadata that is not one of those `known`."""
    for key in segment.meta.values:
        if key not in known:
            raise segment.meta.error(key, "is not a keyword of this metadata")


def instants(segment: Segment) -> tuple[Epoch, np.ndarray]:
    """First instant of a segment's data and the seconds of all after it, increasing, within START_TIME and STOP_TIME.

    TIME_SYSTEM may be UTC, TAI, TT or GPS; the second 60 is taken in UTC within a real leap second alone.
    """
    meta = segment.meta
    system = meta.required("TIME_SYSTEM", ("UTC", *_AFTER))
    start, stop = (
        _tai(meta.required(key), system, meta.file, meta.rows[key], key) for key in ("START_TIME", "STOP_TIME")
    )
    tai = np.array([_tai(tokens[0], system, meta.file, row, "instant") for row, tokens in segment.data])
    t = (tai[:, 0] - tai[0, 0]) * SECONDS_PER_DAY + (tai[:, 1] - tai[0, 1])
    # Half a millisecond: instants of one message may be written with different numbers of digits.
    low, high = ((x[0] - tai[0, 0]) * SECONDS_PER_DAY + (x[1] - tai[0, 1]) for x in (start, stop))
    for wrong, reason in (
        (np.diff(t, prepend=-np.inf) <= 0.0, "is not after the instant before it"),
        ((t < low - 5e-4) | (t > high + 5e-4), "lies outside START_TIME to STOP_TIME"),
    ):
        if wrong.any():
            row, tokens = segment.data[int(np.argmax(wrong))]
            raise InputError(f"{tokens[0]} {reason}", file=meta.file, row=row)
    utc1, utc2 = erfa.taiutc(tai[0, 0], tai[0, 1] / SECONDS_PER_DAY)
    return Epoch(float(utc1), float(utc2)), t


def _tai(text: str, system: str, file: Path | None, row: int, name: str) -> tuple[float, float]:
    """TAI of an instant as the Julian date of a day's beginning [days] and the seconds of that day."""
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


def message_text(
    header: Mapping[str, str],
    segments: Sequence[tuple[Mapping[str, str], Sequence[str]]],
    *,
    aem: bool,
    comments: Sequence[str] = (),
) -> str:
    """Text of a message: keywords of the header, then metadata and lines of data of each segment.

    `comments` open the metadata of each. Raises ValueError for a value that is not one line of ASCII.
    """
    lines = [_pair(key, value) for key, value in header.items()]
    for meta, data in segments:
        width = max(map(len, meta))
        lines += ["", "META_START", *(_ascii(f"COMMENT {comment}") for comment in comments)]
        lines += [*(_pair(f"{key:{width}}", value) for key, value in meta.items()), "META_STOP", ""]
        lines += ["DATA_START", *data, "DATA_STOP"] if aem else data
    return "\n".join(lines) + "\n"


def _pair(key: str, value: str) -> str:
    if not value.strip():
        raise ValueError(f"{key.strip()} has no value")
    return _ascii(f"{key} = {value}")


def _ascii(line: str) -> str:
    if not (line.isascii() and line.isprintable() and len(line) <= LONGEST_LINE):
        raise ValueError(f"expected one line of at most {LONGEST_LINE} printable ASCII characters, got {line[:60]!r}")
    return line
