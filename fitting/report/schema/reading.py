"""Reads a JSON file of a fit back, and looks at it once: types, and numbers in their range."""

from pathlib import Path
from typing import Any

from fitting.report.fit.document import SCHEMA
from fitting.report.schema.kinds import Stored
from jaxsat.errors import InputError
from jaxsat.files.json_files import read_json
from jaxsat.files.toml_files import validated

LIMIT_BYTES = 256 * 2**20
FIT, PROVENANCE, SCENE, CURVES = SCHEMA, "jaxsat.provenance/1", "jaxsat.scene/1", "jaxsat.curves/1"


def read_stored(path: Path, schema: str, kind: type[Stored]) -> dict[str, Any]:
    """Returns the content of one of the files as it stands; `InputError` where it is not what its schema says."""
    document = read_json(path, limit_bytes=LIMIT_BYTES, kind=path.name)
    if document.get("schema") != schema:
        raise InputError(f"expected {schema}, got {str(document.get('schema'))[:40]}", file=path, field="schema")
    validated(kind, document, path)
    return document
