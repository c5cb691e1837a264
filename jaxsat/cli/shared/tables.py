"""Tables among the files of a command, which no satellite file is bundled for."""

from collections.abc import Sequence
from pathlib import Path

from jaxsat.errors import InputError

TABLES = (".csv", ".tsv", ".txt", ".parquet")
"""Endings of tables."""


def refuse_tables(files: Sequence[Path]) -> None:
    """Raises `InputError` of the first table."""
    for path in files:
        if path.suffix.lower() in TABLES:
            reason = "a table needs a satellite file: --satellite sat.toml, of which `jaxsat init` drafts one"
            raise InputError(reason, file=path)
