"""Reads back the files of a fit, all that its report is made of."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fitting.outcome.diagnostics import Diagnostics
from fitting.outcome.result import FitResult, FittedParameter
from fitting.outcome.sensed_result import SensedResult
from fitting.outcome.series import PanelResiduals
from fitting.parameters.null_space import Direction
from fitting.profile.profile import Profile
from fitting.report.document import ATTITUDE_COLUMNS, CURRENT_COLUMNS, SCHEMA
from fitting.report.files import FILES
from fitting.report.page import fit_page
from fitting.report.sensed.files import owned_files
from fitting.report.sensed.page import sensed_page
from fitting.report.sensed.profiles import stored_profile
from fitting.report.sensed.stored import is_sensed, stored_result
from jaxsat.errors import InputError
from jaxsat.files.text_file import read_small_file
from jaxsat.panel_names import PANEL_NAMES

LIMIT_BYTES = 256 * 2**20
SCHEMAS = {"fit.json": SCHEMA, "provenance.json": "jaxsat.provenance/1", "scene.json": "jaxsat.scene/1"}


@dataclass(frozen=True)
class SensedRun:
    """A fit of any satellite as its directory holds it."""

    result: SensedResult
    profiles: tuple[Profile, ...]
    provenance: dict[str, Any]
    scene: dict[str, Any] | None
    """None where the orbit was not kept."""
    pictures: dict[str, bytes]
    """PNG content by file name."""

    def page(self) -> str:
        """The report's HTML."""
        found = {"profiles": self.profiles, "provenance": self.provenance, "scene": self.scene}
        return sensed_page(self.result, self.pictures, **found)


@dataclass(frozen=True)
class Run:
    """A fit of six panel currents as its directory holds it."""

    result: FitResult
    diagnostics: Diagnostics
    profiles: tuple[Profile, ...]
    provenance: dict[str, Any]
    scene: dict[str, Any] | None
    """None where there is no scene.json, as in directories of older versions."""
    pictures: dict[str, bytes]
    """PNG content by file name."""

    def page(self) -> str:
        """The report's HTML."""
        return fit_page(
            self.result,
            self.pictures,
            diagnostics=self.diagnostics,
            profiles=self.profiles,
            provenance=self.provenance,
            scene=self.scene,
        )


def read_run(directory: Path) -> Run | SensedRun:
    """Returns the run; raises `InputError` for a directory that is none, or a file of it that is not as written."""
    if not (directory / "fit.json").exists():
        several = (directory / "summary.json").exists()
        hint = (
            "holds several runs; name one of its directories" if several else "no fit.json; expected results of a fit"
        )
        raise InputError(hint, file=directory)
    fit, provenance = _document(directory / "fit.json"), _document(directory / "provenance.json")
    scene = _document(directory / "scene.json") if (directory / "scene.json").exists() else None
    read = _sensed if is_sensed(fit) else _of_currents
    try:
        return read(directory, fit, provenance, scene)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = f"these are not the files that this version of jaxsat writes ({type(error).__name__}: {error}); "
        raise InputError(reason + "fit the session again", file=directory) from None


def _of_currents(directory: Path, fit: dict, provenance: dict, scene: dict | None) -> Run:
    attitude = _columns(directory / "attitude.csv", ATTITUDE_COLUMNS)
    currents = _columns(directory / "currents.csv", CURRENT_COLUMNS)
    result = _result(fit, provenance, attitude, currents)
    diagnostics, profiles = _diagnostics(fit["diagnostics"]), tuple(stored_profile(p) for p in fit["profiles"].values())
    _ = [provenance[key] for key in ("label", "epoch_utc", "rows", "samples", "orbit", "rejections", "settings")]
    return Run(result, diagnostics, profiles, provenance, scene, _pictures(directory, FILES))


def _sensed(directory: Path, fit: dict, provenance: dict, scene: dict | None) -> SensedRun:
    result = stored_result(directory, fit, provenance, _columns)
    _ = [provenance[key] for key in ("label", "epoch_utc", "paths", "sha256", "size_m", "rejections", "settings")]
    profiles = tuple(stored_profile(each) for each in fit["profiles"].values())
    return SensedRun(result, profiles, provenance, scene, _pictures(directory, owned_files(directory, result.channels)))


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


def _stack(columns: dict[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    return np.column_stack([columns[name] for name in names])


def _result(fit: dict, provenance: dict, attitude: dict, currents: dict) -> FitResult:
    if len(attitude["t_s"]) != len(currents["t_s"]) or len(attitude["t_s"]) != len(fit["attitude"]["t_s"]):
        raise ValueError("fit.json, attitude.csv and currents.csv differ in their number of samples")
    notes, limb = provenance["notes"], fit.get("limb", {})
    directions = ({k: v for k, v in each.items() if k != "blind"} for each in fit["unseen"])
    return FitResult(
        **{name: fit[name] for name in ("status", "message", "chi2", "dof", "residual_rms_mA", "gauge")},
        parameters=tuple(FittedParameter(name, note=notes.get(name, ""), **p) for name, p in fit["parameters"].items()),
        correlations=fit["correlations"],
        t_s=attitude["t_s"],
        quaternion_inertial_from_body=_stack(attitude, [f"q_{c}" for c in "wxyz"]),
        angular_velocity_rad_s=_stack(attitude, [f"rate_{c}_rad_s" for c in "xyz"]),
        attitude_sigma_deg=_stack(attitude, [f"attitude_sigma_{c}_deg" for c in "xyz"]),
        field_angle_deg=attitude["field_angle_deg"],
        field_angle_sigma_deg=attitude["field_angle_sigma_deg"],
        measured_mA=_stack(currents, [f"measured_{p}_mA" for p in PANEL_NAMES]),
        modelled_mA=_stack(currents, [f"modelled_{p}_mA" for p in PANEL_NAMES]),
        modelled_direct_mA=_stack(currents, [f"direct_{p}_mA" for p in PANEL_NAMES]),
        weight=_stack(currents, [f"weight_{p}" for p in PANEL_NAMES]),
        limited=attitude["limited"] > 0.5,
        lit=attitude["lit"] > 0.5,
        limb_samples=limb.get("rows_used", 0),
        limb_rms_deg=limb.get("rms_deg"),
        alternatives=tuple(provenance["alternatives"]),
        unseen=tuple(Direction(**each) for each in directions),
        timing_s=fit["timing_s"],
    )


def _diagnostics(content: dict) -> Diagnostics:
    panels = {name: PanelResiduals(**panel) for name, panel in content["panels"].items()}
    return Diagnostics(**{**content, "panels": panels})
