"""Reads back the files of a fit, all that its report is made of."""

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting.outcome.result import FitResult
from fitting.profile.profile import Profile
from fitting.report.curves_document import stored_between
from fitting.report.fit.owned import owned_files
from fitting.report.fit.profiles import stored_profile
from fitting.report.fit.stored import stored_result
from fitting.report.page.page import fit_page
from fitting.report.schema.curves_file import Curves
from fitting.report.schema.fit_file import Fit
from fitting.report.schema.provenance_file import Provenance
from fitting.report.schema.reading import CURVES, FIT, LIMIT_BYTES, PROVENANCE, SCENE, read_stored
from fitting.report.schema.scene_file import Scene
from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL, read_small_file


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
    page: str
    """The report's HTML."""


LARGEST = 1e100
"""Of the numbers of a table: their squares are numbers still."""
_PNG = b"\x89PNG\r\n\x1a\n"


def read_run(directory: Path, *, base: str = "") -> Run:
    """Returns the run; raises `InputError` for a directory that is none, or a file of it that is not as written.

    `base` is what stands before the names of its files in the page's links, where the page is to lie elsewhere.
    """
    if not (directory / "fit.json").exists():
        several = (directory / "summary.json").exists()
        hint = (
            "holds several runs; name one of its directories" if several else "no fit.json; expected results of a fit"
        )
        raise InputError(hint, file=directory)
    fit = read_stored(directory / "fit.json", FIT, Fit)
    provenance = read_stored(directory / "provenance.json", PROVENANCE, Provenance)
    scene = read_stored(directory / "scene.json", SCENE, Scene) if (directory / "scene.json").exists() else None
    try:
        return _run(directory, fit, provenance, scene, base)
    except InputError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        reason = f"these are not the files that this version of jaxsat writes ({type(error).__name__}: {error}); "
        raise InputError(reason + "fit the session again", file=directory) from None


def _run(directory: Path, fit: dict, provenance: dict, scene: dict | None, base: str) -> Run:
    result = stored_result(directory, fit, provenance, _columns)
    if (directory / "curves.json").exists():
        curves = read_stored(directory / "curves.json", CURVES, Curves)
        columns = {name: len(channel.columns) for name, channel in result.channels.items()}
        result = replace(result, between=stored_between(curves, columns))
    profiles = tuple(stored_profile(each) for each in fit["profiles"].values())
    pictures = _pictures(directory, owned_files(directory, result.channels))
    about = {"provenance": provenance, "scene": scene, "profiles": profiles, "base": base}
    return Run(result, profiles, provenance, scene, pictures, fit_page(result, pictures, **about))


def _pictures(directory: Path, names: Iterable[str]) -> dict[str, bytes]:
    return {name: (directory / name).read_bytes() for name in names if _is_picture(directory / name)}


def _is_picture(path: Path) -> bool:
    """Not a link to one, which may be anything of anybody's."""
    if path.suffix != ".png" or path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(_PNG)) == _PNG


def _columns(path: Path, expected: Iterable[str]) -> dict[str, np.ndarray]:
    """Numbers by column; an empty field is NaN, and so is all of `utc`."""
    text = read_small_file(path, limit_bytes=LIMIT_BYTES, kind="CSV").decode("utf-8", errors="replace")
    try:
        rows = list(csv.reader(io.StringIO(text)))
    except csv.Error as error:
        raise InputError(f"damaged CSV: {error}", file=path) from None
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
                table[number - 2, column] = float(field) if REAL.fullmatch(field) else np.inf
                if abs(table[number - 2, column]) > LARGEST:
                    raise InputError(f"expected a number, got {field[:24]!r}", file=path, row=number, field=name)
    return dict(zip(names, table.T, strict=True))
