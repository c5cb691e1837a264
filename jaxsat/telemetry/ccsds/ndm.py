"""What attitude and orbit ephemeris messages of CCSDS share in their KEYWORD = VALUE form: header, segments, instants.

CCSDS 502.0-B (orbit) and 504.0-B (attitude). A message that is damaged ends with an error: nothing is guessed.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL, read_small_file
from jaxsat.time import Epoch

MAX_FILE_BYTES = 256 * 2**20
"""Room for about two million lines."""
LONGEST_LINE = 254
"""Characters, what the standards allow."""

_KEY_LINE = re.compile(r"[ \t]*([A-Z0-9_]+)[ \t]*=[ \t]*(.*?)[ \t]*")
_HEADER = ("CLASSIFICATION", "CREATION_DATE", "ORIGINATOR", "MESSAGE_ID")
LARGEST = 1e12
"""Of the numbers of a message: a tenth of a light year in km. What is beyond is damage, and would overflow."""
_COVARIANCE = "COVARIANCE_START"


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
    covariances: list[tuple[int, list[tuple[int, str]]]] = field(default_factory=list)
    """Of each block its first line's number, and what stands within it with the line numbers."""


def read_message(path: str | Path, *, kind: str, versions: Sequence[str]) -> tuple[Block, list[Segment]]:
    """Header and segments of a message of a `kind`, AEM or OEM; comments are passed over.

    Raises `InputError` with file and line for anything but ASCII, another kind or version, a keyword given twice or out
    of place, a line too long, blocks that do not close, a message without data, one whose segments differ in their
    TIME_SYSTEM, and a segment given twice.
    """
    path = Path(path)
    lines = _lines(path, kind)
    header: Block | None = None
    segments: list[Segment] = []
    # Where we are: before the metadata, within it, after it, within data, or within a covariance.
    place = "header"
    for row, line in lines:
        word = line.strip(" \t")
        if not word or word.split(None, 1)[0] == "COMMENT":
            continue
        if place == "covariance":
            begin, block = segments[-1].covariances[-1]
            if word == "COVARIANCE_STOP":
                place = "between"
            elif word in ("META_START", "COVARIANCE_START"):
                raise InputError(f"is not closed before {word} in line {row}", file=path, row=begin, field=_COVARIANCE)
            else:
                block.append((row, word))
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
        elif word == _COVARIANCE and kind == "OEM" and segments and place in ("data", "between"):
            segments[-1].covariances.append((row, []))
            place = "covariance"
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
    if place == "covariance":
        raise InputError("is not closed", file=path, row=segments[-1].covariances[-1][0], field=_COVARIANCE)
    if place not in closed:
        raise InputError(f"ends within its {'metadata' if place == 'meta' else place}", file=path, row=last)
    for segment in segments:
        if not segment.data:
            raise InputError("a segment without data", file=path, row=segment.meta.row)
    _check_header(header, kind)
    _check_together(segments)
    return header, segments


def _check_header(header: Block, kind: str) -> None:
    for key in header.values:
        if key not in (f"CCSDS_{kind}_VERS", *_HEADER):
            raise header.error(key, "is not a keyword of the header")
    created = header.values.get("CREATION_DATE")
    try:
        _ = created and Epoch.from_iso(created)
    except ValueError as error:
        raise header.error("CREATION_DATE", str(error)) from None


def _check_together(segments: Sequence[Segment]) -> None:
    found: dict[tuple[tuple[str, str], ...], int] = {}
    first = segments[0].meta
    for segment in segments:
        meta = segment.meta
        system, other = meta.values.get("TIME_SYSTEM"), first.values.get("TIME_SYSTEM")
        if system != other:
            reason = f"{system} after {other} in line {first.rows.get('TIME_SYSTEM', first.row)}: a message has one"
            raise meta.error("TIME_SYSTEM", reason)
        same = found.setdefault(tuple(sorted(meta.values.items())), meta.row)
        if same != meta.row:
            raise InputError(f"repeats the segment of line {same}", file=meta.file, row=meta.row)


def _lines(path: Path, kind: str) -> list[tuple[int, str]]:
    data = read_small_file(path, limit_bytes=MAX_FILE_BYTES, kind=kind)
    found = []
    for row, raw in enumerate(data.split(b"\n"), 1):
        line = raw.removesuffix(b"\r")
        if len(line) > LONGEST_LINE:
            raise InputError(f"line has {len(line)} characters, expected at most {LONGEST_LINE}", file=path, row=row)
        # Printable, which control characters are not; tabs are blanks.
        if not (line.isascii() and line.replace(b"\t", b" ").decode("ascii").isprintable()):
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
        wrong = [t for t, value in zip(tokens[1:], values, strict=True) if not abs(value) <= LARGEST]
        if wrong:
            limit = f" of at most {LARGEST:g}" if REAL.fullmatch(wrong[0]) else ""
            reason = f"expected a plain decimal number{limit}, found {wrong[0][:24]!r}"
            raise InputError(reason, file=file, row=row)
        table.append(values[:columns])
    return np.array(table)


def check_keywords(segment: Segment, known: Sequence[str]) -> None:
    """Raises `InputError` for a keyword of the metadata not among those `known`, and for a degree that is none."""
    meta = segment.meta
    for key in meta.values:
        if key not in known:
            raise meta.error(key, "is not a keyword of this metadata")
    degree = meta.values.get("INTERPOLATION_DEGREE", "1")
    if not re.fullmatch("0*[1-9][0-9]{0,2}", degree):
        raise meta.error("INTERPOLATION_DEGREE", f"expected a whole number from 1 to 999, found {degree[:24]!r}")
