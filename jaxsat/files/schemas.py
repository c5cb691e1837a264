"""The JSON Schemas (draft 2020-12) of every JSON file that a command writes, which stand in `jaxsat/data/schemas`."""

import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent.parent / "data" / "schemas"


def schema_names() -> list[str]:
    """Returns the names of all schemas, as the key `schema` of a file has them: `jaxsat.fit/1` ..."""
    return sorted(f"jaxsat.{name}/{version}" for name, version in map(_parts, FOLDER.glob("*/*.json")))


def schema(name: str) -> dict[str, Any]:
    """Returns the schema of files that say `name` under their key `schema`.

    Raises ValueError for a name that is none. Any validator takes it: the package itself needs none.
    """
    for path in FOLDER.glob("*/*.json"):
        own, version = _parts(path)
        if f"jaxsat.{own}/{version}" == name:
            return json.loads(path.read_text("utf-8"))
    raise ValueError(f"expected one of {', '.join(schema_names())}, got {name!r}")


def _parts(path: Path) -> tuple[str, str]:
    name, _, version = path.stem.rpartition("-")
    return name, version
