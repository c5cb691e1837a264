"""Configuration files: TOML to `Config`, and a commented template of all keys."""

import json
from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel

from jaxsat.cli.settings.sections import Config as Config
from jaxsat.files.toml_files import read_toml, validated, with_values


def load_config(path: str | Path | None = None, overrides: Mapping[str, object] | None = None) -> Config:
    """Returns the configuration of a TOML file, or the defaults; `overrides` maps `section.key` to values in its place.

    Raises `InputError` with the path of the first wrong key and the paths of the others, or with the line of a TOML
    syntax error.
    """
    data = {} if path is None else read_toml(path, kind="TOML configuration")
    return validated(Config, with_values(data, overrides), path)


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
