"""Configuration files: TOML to `Config` with every error found at once, and a commented template of all keys."""

import difflib
import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ValidationError

from jaxsat.cli.settings.sections import Config as Config
from jaxsat.errors import InputError
from jaxsat.telemetry.text_file import read_small_file

_LIMIT_BYTES = 2**20


def load_config(path: str | Path | None = None, overrides: Mapping[str, object] | None = None) -> Config:
    """Returns the configuration of a TOML file, or the defaults; `overrides` maps `section.key` to values in its place.

    Raises `InputError` with the path of the first wrong key and the paths of the others, or with the line of a TOML
    syntax error.
    """
    data = {} if path is None else _parse(Path(path))
    for key, value in (overrides or {}).items():
        section, _, name = key.partition(".")
        # A section that is no table is left as it is, for the validation to refuse.
        if isinstance(data.setdefault(section, {}), dict):
            data[section][name] = value
    try:
        return Config.model_validate(data)
    except ValidationError as error:
        raise _input_error(error, path) from None


def template() -> str:
    """Returns TOML text with every key, its meaning, unit and default; loaded, it gives the defaults.

    A key without default is commented out, with an example.
    """
    lines = [
        "# Configuration of jaxsat: every key with its default. A key that is commented out is found automatically."
    ]
    for section in Config.model_fields:
        lines += _table(section, getattr(Config(), section))
    return "\n".join(lines) + "\n"


def _table(path: str, section: BaseModel) -> list[str]:
    heading = (type(section).__doc__ or "").strip().splitlines()[0]
    lines, nested = ["", f"# {heading}", f"[{path}]"], []
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            nested += _table(f"{path}.{name}", value)
            continue
        lines.append(f"# {field.description}")
        example = field.examples[0] if field.examples else None
        lines.append(f"# {name} = {_toml(example)}" if value is None else f"{name} = {_toml(value)}")
    return lines + nested


def _toml(value: object) -> str:
    """Numbers, strings, booleans and lists of them are written alike in JSON and TOML."""
    return json.dumps(value)


def _parse(path: Path) -> dict:
    data = read_small_file(path, limit_bytes=_LIMIT_BYTES, kind="TOML configuration")
    try:
        return tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise InputError("not UTF-8 text; expected TOML", file=path, row=row) from None
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        row = int(place[1]) if place else data.count(b"\n") + 1
        reason = re.sub(r" \(at .*\)$", "", str(error)) + (f" at column {place[2]}" if place else " at the end")
        raise InputError(f"TOML syntax: {reason}", file=path, row=row) from None
    except RecursionError:
        raise InputError("TOML syntax: nested too deeply", file=path) from None


def _input_error(error: ValidationError, path: str | Path | None) -> InputError:
    found = error.errors(include_url=False)
    keys = [_key(item["loc"]) for item in found]
    others = sorted(set(keys[1:]) - {keys[0]})
    reason = _reason(found[0])
    if others:
        shown = ", ".join(others[:8]) + (", ..." if len(others) > 8 else "")
        reason += f" (and {len(others)} more wrong: {shown})"
    return InputError(reason, file=path, field=keys[0])


def _key(location: tuple[int | str, ...]) -> str:
    return re.sub(r"\.(\[)", r"\1", ".".join(f"[{part}]" if isinstance(part, int) else part for part in location))


def _reason(item) -> str:
    """One error in a few words: what was expected, what came."""
    if item["type"] == "extra_forbidden":
        return "unknown key" + _suggestion(item["loc"])
    message = item["msg"].removeprefix("Value error, ")
    value = item["input"]
    if item["type"] in ("missing", "value_error") and not isinstance(value, str | int | float):
        return message
    shown = repr(value)
    return f"{message}, found {shown if len(shown) <= 60 else shown[:57] + '...'}"


def _suggestion(location: tuple[int | str, ...]) -> str:
    model: type[BaseModel] = Config
    for part in location[:-1]:
        annotation = model.model_fields[str(part)].annotation
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            return ""
        model = annotation
    close = difflib.get_close_matches(str(location[-1]), model.model_fields, n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; expected one of {', '.join(model.model_fields)}"
