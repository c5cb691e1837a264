"""The four written forms of orbit mean-elements messages, XML, KVN, JSON and CSV, each read into records of text."""

import csv
import io
import json
import re
from collections import Counter
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from jaxsat.errors import InputError
from jaxsat.telemetry.elements.omm import VERSIONS, OmmRecord

# A unit follows numbers alone: brackets in a satellite's name are part of it.
_KVN_LINE = re.compile(r"\s*([A-Z0-9_]+)\s*=\s*(?:([+-]?[0-9.]\S*)\s*\[\s*([^\]]*?)\s*\]|(.*?))\s*")

# Four times what the standard allows; beyond that the search for brackets would take long.
_LONGEST_KVN_LINE = 1016
_DEEPEST = 32
"""Levels of XML; messages have seven."""


def looks_like_omm(text: str) -> bool:
    """Whether a text is one of the four forms of OMM rather than a file of two-line elements."""
    start = text.lstrip()
    first = start.split("\n", 1)[0]
    return start[0] in "<[{" or _is_kvn(text) or ("EPOCH" in first and ("," in first or ";" in first))


def _is_kvn(text: str) -> bool:
    for line in io.StringIO(text):
        if line.strip() and line.split()[0] != "COMMENT":
            return line.lstrip().startswith("CCSDS_OMM_VERS")
    return False


def read_omm_records(text: str, file: Path) -> list[OmmRecord]:
    """Messages of a file in their order; `InputError` where the form is damaged or there is no message."""
    start = text.lstrip()
    if start[0] == "<":
        records = _read_xml(text, file)
    elif start[0] in "[{":
        records = _read_json(text, file)
    elif _is_kvn(text):
        records = _read_kvn(text, file)
    else:
        records = _read_csv(text, file)
    if not records:
        raise InputError("holds no orbit mean-elements message", file=file)
    return records


def _read_xml(text: str, file: Path) -> list[OmmRecord]:
    records: list[OmmRecord] = []
    path: list[str] = []
    words: list[str] = []
    state = {"row": 1, "unit": "", "leaf": True}
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        if not path and tag not in ("omm", "ndm"):
            raise InputError(f"expected a message <omm> or <ndm>, found <{tag[:24]}>", file=file, row=row())
        if len(path) >= _DEEPEST:
            raise InputError(f"<{tag[:24]}> is nested too deeply", file=file, row=row())
        version = attributes.get("version", VERSIONS[0])
        if tag == "omm" and version not in VERSIONS:
            reason = f"expected {' or '.join(VERSIONS)}, found {version[:24]!r}"
            raise InputError(reason, file=file, row=row(), field="OMM version")
        if tag == "segment":
            records.append(OmmRecord(file, row(), len(records) + 1))
        path.append(tag)
        words.clear()
        state.update(row=row(), unit=attributes.get("units", ""), leaf=True)

    def end(tag: str) -> None:
        path.pop()
        if state["leaf"] and "segment" in path and tag not in ("COMMENT", "USER_DEFINED"):
            records[-1].add(tag, "".join(words), state["row"], state["unit"])
        state["leaf"] = False

    def row() -> int:
        return parser.CurrentLineNumber

    def refuse(*_: object) -> NoReturn:
        raise InputError("a document type declaration has no place in a message", file=file, row=row())

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = words.append, refuse
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = f"damaged XML at column {error.offset + 1}: {expat.ErrorString(error.code)}"
        raise InputError(reason, file=file, row=error.lineno) from None
    return records


def _read_kvn(text: str, file: Path) -> list[OmmRecord]:
    records: list[OmmRecord] = []
    for row, line in enumerate(text.split("\n"), 1):
        if not line.strip() or line.split()[0] == "COMMENT":
            continue
        match = _KVN_LINE.fullmatch(line) if len(line) <= _LONGEST_KVN_LINE else None
        if match is None:
            raise InputError(f"expected NAME = VALUE, found {line.strip()[:24]!r}", file=file, row=row)
        name, number, unit, word = match.groups()
        if name == "CCSDS_OMM_VERS":
            records.append(OmmRecord(file, row, len(records) + 1))
        elif not records:
            raise InputError(f"expected CCSDS_OMM_VERS = ..., found {name[:24]!r}", file=file, row=row)
        records[-1].add(name, number or word, row, unit or "")
    return records


def _read_json(text: str, file: Path) -> list[OmmRecord]:
    def refuse(word: str) -> NoReturn:
        raise InputError(f"expected numbers, found {word}", file=file)

    def once(pairs: list[tuple[str, object]]) -> dict[str, object]:
        found = dict(pairs)
        if len(found) != len(pairs):
            names = Counter(name for name, _ in pairs)
            twice = min(name for name, count in names.items() if count > 1)
            raise InputError("is given twice in one message", file=file, field=f"OMM {twice[:40]}")
        return found

    try:
        # Numbers stay text, to be checked as in the other forms.
        found = json.loads(text, parse_float=str, parse_int=str, parse_constant=refuse, object_pairs_hook=once)
    except json.JSONDecodeError as error:
        raise InputError(f"damaged JSON at column {error.colno}: {error.msg}", file=file, row=error.lineno) from None
    except RecursionError:
        raise InputError("damaged JSON: nested too deeply", file=file) from None
    messages = found if isinstance(found, list) else [found]
    records = []
    for number, message in enumerate(messages, 1):
        if not isinstance(message, dict):
            raise InputError(f"expected an object of named fields as message {number}", file=file)
        record = OmmRecord(file, None, number)
        for name, value in message.items():
            if value is not None and not isinstance(value, str):
                raise record.error(name, "expected a number or a text")
            record.add(name, value or "")
        records.append(record)
    return records


def _read_csv(text: str, file: Path) -> list[OmmRecord]:
    first = text.lstrip().split("\n", 1)[0]
    if first.count(";") > first.count(","):
        raise InputError("the fields stand between semicolons; expected commas", file=file, row=1)
    reader = csv.reader(io.StringIO(text.lstrip(), newline=""), strict=True)
    skipped = text[: len(text) - len(text.lstrip())].count("\n")
    records: list[OmmRecord] = []
    try:
        names = [name.strip() for name in next(reader)]
        for values in reader:
            row = reader.line_num + skipped
            if not values:
                continue
            if len(values) != len(names):
                raise InputError(f"expected {len(names)} fields, found {len(values)}", file=file, row=row)
            record = OmmRecord(file, row, len(records) + 1)
            for name, value in zip(names, values, strict=True):
                record.add(name, value, row)
            records.append(record)
    except csv.Error as error:
        raise InputError(f"damaged CSV: {error}", file=file, row=reader.line_num + skipped) from None
    return records
