"""Strict JSON: plain values, no number that is not finite, one look for all commands; read back as strictly."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import hidden_character, read_small_file

_NO_LINES = re.compile(r"[\n\r\t]")
LARGEST_WHOLE = 2**63 - 1
"""What other programs take for a whole number."""


def read_json(path: Path, *, limit_bytes: int, kind: str) -> dict[str, Any]:
    """Returns the object that a file holds; `kind` is for messages.

    Raises `InputError` where it is none, or holds a number that is not finite or whole beyond 64 bits, a key twice, a
    character that no text shows, or more levels than Python can go.
    """
    data = read_small_file(path, limit_bytes=limit_bytes, kind=kind)
    try:
        found = json.loads(data.decode("utf-8"), parse_constant=_refuse, object_pairs_hook=_once)
        _check(found, "")
    except UnicodeDecodeError:
        raise InputError("is no UTF-8 text", file=path) from None
    except ValueError as error:
        raise InputError(f"is no JSON: {error}", file=path) from None
    except RecursionError:
        raise InputError("is no JSON: nested too deeply", file=path) from None
    if not isinstance(found, dict):
        raise InputError(f"is no {kind}: expected an object of named values", file=path)
    return found


def _refuse(word: str) -> Any:
    raise ValueError(f"{word} is no number of JSON")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key is given twice")
    return found


def _check(value: Any, place: str) -> None:
    if isinstance(value, dict):
        for key, item in value.items():
            own = f"{place}.{key}" if place else key
            if hidden := hidden_character(key):
                raise ValueError(f"{own}: {hidden} in a key")
            _check(item, own)
    elif isinstance(value, list):
        for item in value:
            _check(item, place)
    elif isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{place}: a number beyond what can be told")
    elif isinstance(value, int):
        if abs(value) > LARGEST_WHOLE:
            raise ValueError(f"{place}: a whole number beyond 64 bits")
    elif isinstance(value, str) and (hidden := hidden_character(_NO_LINES.sub("", value))):
        raise ValueError(f"{place}: {hidden}")


def plain(document: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Returns a document in plain Python, and the places where a number that is not finite became null."""
    nulls: list[str] = []
    return _plain(document, "", nulls), nulls


def _plain(value: Any, place: str, nulls: list[str]) -> Any:
    """NumPy to plain Python; a number that is not finite becomes None and its place is noted, a list once."""
    if isinstance(value, dict):
        return {str(key): _plain(item, f"{place}.{key}" if place else str(key), nulls) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item, place, nulls) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        if place not in nulls:
            nulls.append(place)
        return None
    return value


def json_text(document: dict[str, Any]) -> str:
    """Returns strict JSON with one key a line and each list on one line, or one row a line where it holds lists.

    Raises `ValueError` for a number that is not finite.
    """
    return _json(document, "") + "\n"


def _json(value: Any, indent: str) -> str:
    deeper = indent + "  "
    if isinstance(value, dict) and value and any(isinstance(item, dict | list) for item in value.values()):
        items = [f"{deeper}{json.dumps(str(key))}: {_json(item, deeper)}" for key, item in value.items()]
        return "{\n" + ",\n".join(items) + f"\n{indent}}}"
    if isinstance(value, list) and value and isinstance(value[0], list | dict):
        if all(type(item) is list and item and type(item[0]) is float for item in value):
            # Tables of numbers are long, and one call for all rows takes a fifth of the time of one a row.
            rows = json.dumps(value, allow_nan=False)[1:-1].replace("], [", f"],\n{deeper}[")
        else:
            rows = f",\n{deeper}".join(_json(item, deeper) for item in value)
        return f"[\n{deeper}{rows}\n{indent}]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Writes strict JSON, UTF-8."""
    path.write_text(json_text(document), encoding="utf-8")
