"""TOML files: read within limits, checked against a model with every error found at once."""

import difflib
import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from jaxsat.errors import InputError
from jaxsat.files.json_files import LARGEST_WHOLE
from jaxsat.files.text_file import hidden_character, read_small_file

_LIMIT_BYTES = 2**20
LARGEST = 1e30
"""Of the numbers of a file, whatever their unit: its tenth power still is a number."""
# The reader of TOML takes a time that goes with the square of the parts of a key.
_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![A-Za-z0-9_-])(?:{_PART}\.[ \t]*+){{32}}")
Model = TypeVar("Model", bound=BaseModel)


def read_toml(path: str | Path, *, kind: str) -> dict[str, Any]:
    """Returns the tables of a file; raises `InputError` with the line of a syntax error. `kind` is for messages."""
    path = Path(path)
    data = read_small_file(path, limit_bytes=_LIMIT_BYTES, kind=kind)
    try:
        text = data.decode("utf-8")
        if _DEEP_KEY.search(text):
            raise RecursionError
        found = tomllib.loads(text)
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise InputError("not UTF-8 text; expected TOML", file=path, row=row) from None
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        row = int(place[1]) if place else data.count(b"\n") + 1
        reason = re.sub(r" \(at .*\)$", "", str(error)) + (f" at column {place[2]}" if place else " at the end")
        raise InputError(f"TOML syntax: {reason}", file=path, row=row) from None
    except ValueError as error:
        # Of Python: more digits than it reads.
        raise InputError(f"TOML syntax: {str(error).partition(';')[0]}", file=path) from None
    except RecursionError:
        raise InputError("TOML syntax: nested too deeply", file=path) from None
    _check(found, "", path)
    return found


def _check(value: Any, key: str, path: Path) -> None:
    """Raises `InputError` for what no setting is: numbers whose products overflow, characters that nothing shows."""
    if isinstance(value, dict):
        for name, inner in value.items():
            own = f"{key}.{name}" if key else name
            if hidden := hidden_character(name):
                raise InputError(f"{hidden} has no place in a key", file=path, field=own)
            _check(inner, own, path)
    elif isinstance(value, list):
        for inner in value:
            _check(inner, key, path)
    elif isinstance(value, int) and abs(value) > LARGEST_WHOLE:
        raise InputError(f"expected a whole number of 64 bits, found {str(value)[:24]}", file=path, field=key)
    elif isinstance(value, float) and LARGEST < abs(value) < math.inf:
        raise InputError(f"expected a number of at most {LARGEST:g}, found {value:g}", file=path, field=key)
    elif isinstance(value, str) and (hidden := hidden_character(value.replace("\n", "").replace("\t", ""))):
        raise InputError(f"{hidden} has no place in it", file=path, field=key)


def with_values(data: Mapping[str, Any], changed: Mapping[str, object] | None) -> dict[str, Any]:
    """Returns the tables with other values; `changed` maps `section.key` to them."""
    found = {section: dict(table) if isinstance(table, Mapping) else table for section, table in data.items()}
    for key, value in (changed or {}).items():
        section, _, name = key.partition(".")
        # A section that is no table is left as it is, for the validation to refuse.
        if isinstance(found.setdefault(section, {}), dict):
            found[section][name] = value
    return found


def validated(model: type[Model], data: Mapping[str, Any], path: str | Path | None = None) -> Model:
    """Returns the model of the data.

    Raises `InputError` with the path of the first wrong key, its reason, and the paths of the others.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _input_error(model, error, path) from None


def wrong_keys(model: type[BaseModel], data: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Returns path and reason of every key that the model refuses; none where it takes the data."""
    try:
        model.model_validate(data)
    except ValidationError as error:
        return [(_key(item["loc"]), _reason(model, item)) for item in error.errors(include_url=False)]
    return []


def _input_error(model: type[BaseModel], error: ValidationError, path: str | Path | None) -> InputError:
    found = error.errors(include_url=False)
    keys = [_key(item["loc"]) for item in found]
    others = sorted(set(keys[1:]) - {keys[0]})
    reason = _reason(model, found[0])
    if others:
        shown = ", ".join(others[:8]) + (", ..." if len(others) > 8 else "")
        reason += f" (and {len(others)} more wrong: {shown})"
    return InputError(reason, file=path, field=keys[0])


def _key(location: tuple[int | str, ...]) -> str:
    return re.sub(r"\.(\[)", r"\1", ".".join(f"[{part}]" if isinstance(part, int) else part for part in location))


def _reason(model: type[BaseModel], item) -> str:
    """One error in a few words: what was expected, what came."""
    if item["type"] == "extra_forbidden":
        return "unknown key" + _suggestion(model, item["loc"])
    message = item["msg"].removeprefix("Value error, ")
    value = item["input"]
    if item["type"] in ("missing", "value_error") and not isinstance(value, str | int | float):
        return message
    shown = repr(value)
    return f"{message}, found {shown if len(shown) <= 60 else shown[:57] + '...'}"


def _suggestion(model: type[BaseModel], location: tuple[int | str, ...]) -> str:
    for part in location[:-1]:
        if str(part) not in model.model_fields:
            # The place in a list, or the name in a table of tables, of what has been found already.
            continue
        inner = _section_of(model.model_fields[str(part)].annotation)
        if inner is None:
            return ""
        model = inner
    close = difflib.get_close_matches(str(location[-1]), model.model_fields, n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; expected one of {', '.join(model.model_fields)}"


def _section_of(annotation: Any) -> type[BaseModel] | None:
    """The section that an annotation is of, or that it is a list, a table or an alternative of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = (_section_of(inner) for inner in get_args(annotation))
    return next((section for section in found if section is not None), None)
