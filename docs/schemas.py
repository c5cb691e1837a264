"""The JSON Schemas on the site: each as a file, and a page that says what the keys of each file mean."""

import json
from typing import Any

from jaxsat.files.schemas import schema, schema_names

PAGE = "reference/schemas.md"


def files() -> dict[str, str]:
    """The page and the schemas themselves, by their places on the site."""
    return {PAGE: page()} | {_file(name): json.dumps(schema(name), indent=2) + "\n" for name in schema_names()}


def page() -> str:
    """Every key of the first levels of each file: kind, meaning, whether it may be absent."""
    parts = [
        "# JSON Schemas",
        "What stands in the JSON files that commands write, by the name under their key `schema`. The schemas "
        "themselves (draft 2020-12) say all of it, to the last level; they are files of this site and of the package "
        "(`jaxsat/data/schemas/`, `jaxsat.files.schemas.schema(name)`). A number that may be `null` is one that is not "
        "known, or not finite.",
    ]
    for name in schema_names():
        own = schema(name)
        parts += [f"## {name}", f"{own['description']} [The schema](../{_file(name)})."]
        for each in own.get("oneOf", [own]):
            if "oneOf" in own:
                parts.append(each["description"])
            rows = ["| key | kind | meaning |", "|---|---|---|", *_rows(each, own, "")]
            parts.append("\n".join(rows))
    return "\n\n".join(parts)


def _file(name: str) -> str:
    return f"schemas/{name.removeprefix('jaxsat.').replace('/', '-')}.json"


def _rows(part: dict[str, Any], whole: dict[str, Any], before: str) -> list[str]:
    found = []
    for key, value in part["properties"].items():
        absent = "" if key in part["required"] else ", may be absent"
        meaning = value.get("description", "")
        inner = _followed(value, whole)
        meaning = meaning or inner.get("description", "")
        found.append(f"| `{before}{key}` | {_kind(value, whole)}{absent} | {meaning.replace('|', chr(92) + '|')} |")
        if not before and inner.get("type") == "object" and "properties" in inner:
            found += _rows(inner, whole, f"{key}.")
    return found


def _followed(part: dict[str, Any], whole: dict[str, Any]) -> dict[str, Any]:
    if "$ref" in part:
        return whole["$defs"][part["$ref"].rpartition("/")[2]]
    return part


def _kind(part: dict[str, Any], whole: dict[str, Any]) -> str:
    part = _followed(part, whole)
    if "const" in part:
        return f"`{part['const']}`"
    if "enum" in part:
        return ", ".join(f"`{each}`" for each in part["enum"])
    if "anyOf" in part:
        return " or ".join(_kind(each, whole) for each in part["anyOf"])
    kind = part["type"]
    if isinstance(kind, list):
        return " or ".join(kind)
    if kind == "array":
        least, most = part.get("minItems"), part.get("maxItems")
        count = f"{most} of " if most is not None and least == most else ""
        return f"list of {count}{_kind(part['items'], whole)}"
    if kind == "object" and isinstance(part.get("additionalProperties"), dict):
        return f"by name: {_kind(part['additionalProperties'], whole)}"
    return kind
