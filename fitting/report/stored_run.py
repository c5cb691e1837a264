"""Reads back the files of a fit, all that its report is made of."""

import csv
import io
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fitting.outcome.result import FitResult
from fitting.profile.profile import Profile
from fitting.report.fit.document import SCHEMA
from fitting.report.fit.owned import owned_files
from fitting.report.fit.page import fit_page
from fitting.report.fit.profiles import stored_profile
from fitting.report.fit.stored import stored_result
from jaxsat.errors import InputError
from jaxsat.files.text_file import read_small_file

LIMIT_BYTES = 256 * 2**20
SCHEMAS = {"fit.json": SCHEMA, "provenance.json": "jaxsat.provenance/1", "scene.json": "jaxsat.scene/1"}


SHOWN = (
    *("label", "epoch_utc", "paths", "sha256", "size_m", "rows", "samples", "orbit", "rejections", "settings"),
    "satellite_file",
)
"""What a page takes of the provenance."""


@dataclass(frozen=True)
class Run:
    """A fit as its directory holds it."""

    result: FitResult
    profiles: tuple[Profile, ...]
    provenance: dict[str, Any]
    scene: dict[str, Any] | None
    """None where the orbit was not kept."""
    pictures: dict[str, bytes]
    """PNG content by file name."""

    def page(self) -> str:
        """The report's HTML."""
        about = {"provenance": self.provenance, "scene": self.scene, "profiles": self.profiles}
        return fit_page(self.result, self.pictures, **about)


def read_run(directory: Path) -> Run:
    """Returns the run; raises `InputError` for a directory that is none, or a file of it that is not as written."""
    if not (directory / "fit.json").exists():
        several = (directory / "summary.json").exists()
        hint = (
            "holds several runs; name one of its directories" if several else "no fit.json; expected results of a fit"
        )
        raise InputError(hint, file=directory)
    fit, provenance = _document(directory / "fit.json"), _document(directory / "provenance.json")
    scene = _document(directory / "scene.json") if (directory / "scene.json").exists() else None
    try:
        return _run(directory, fit, provenance, scene)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = f"these are not the files that this version of jaxsat writes ({type(error).__name__}: {error}); "
        raise InputError(reason + "fit the session again", file=directory) from None


def _run(directory: Path, fit: dict, provenance: dict, scene: dict | None) -> Run:
    result = stored_result(directory, fit, provenance, _columns)
    profiles = tuple(stored_profile(each) for each in fit["profiles"].values())
    _ = [provenance[key] for key in SHOWN]
    return Run(result, profiles, provenance, scene, _pictures(directory, owned_files(directory, result.channels)))


def _pictures(directory: Path, names: Iterable[str]) -> dict[str, bytes]:
    return {name: (directory / name).read_bytes() for name in names if _is_picture(directory / name)}


def _is_picture(path: Path) -> bool:
    return path.suffix == ".png" and path.is_file()


def _document(path: Path) -> dict[str, Any]:
    text = read_small_file(path, limit_bytes=LIMIT_BYTES, kind="JSON")
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"is no JSON: {error}", file=path) from None
    found = document.get("schema") if isinstance(document, dict) else None
    if found != SCHEMAS[path.name]:
        raise InputError(f"expected {SCHEMAS[path.name]}, got {found}", file=path, field="schema")
    return document


def _columns(path: Path, expected: Iterable[str]) -> dict[str, np.ndarray]:
    """Numbers by column; an empty field is NaN, and so is all of `utc`."""
    text = read_small_file(path, limit_bytes=LIMIT_BYTES, kind="CSV").decode("utf-8", errors="replace")
    rows = list(csv.reader(io.StringIO(text)))
    names = list(expected)
    if rows[0] != names:
        missing = [name for name in names if name not in rows[0]] or ["other columns"]
        raise InputError(f"expected the columns that a fit writes; missing: {', '.join(missing)}", file=path, row=1)
    table = np.full((len(rows) - 1, len(names)), np.nan)
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(names):
            raise InputError(f"{len(row)} fields; expected {len(names)}", file=path, row=number)
        for column, (name, field) in enumerate(zip(names, row, strict=True)):
            if field and name != "utc":
                try:
                    table[number - 2, column] = float(field)
                except ValueError:
                    raise InputError(f"expected a number, got {field!r}", file=path, row=number, field=name) from None
    return dict(zip(names, table.T, strict=True))
