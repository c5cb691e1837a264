"""Strict JSON: plain values, no number that is not finite, one look for all commands."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np


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
