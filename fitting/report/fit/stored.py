"""Reads back a fit of any satellite from its files."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fitting.outcome.result import Break, Cause, ChannelFit, FitResult, FittedParameter, Holdout, Wish
from fitting.outcome.series import PanelResiduals
from fitting.parameters.null_space import Direction
from fitting.report.fit.owned import file_stems
from fitting.report.fit.tables import ATTITUDE_COLUMNS

ARRAYS = ("measured", "modelled", "residual", "promised")
FURTHER = ("direct", "weight")
"""Of some channels alone."""
Columns = Callable[[Path, Iterable[str]], dict[str, np.ndarray]]
"""Reads a table with given columns: numbers by their names, NaN where a field is empty."""


def stored_result(directory: Path, fit: dict, provenance: dict, columns: Columns) -> FitResult:
    """Returns the result; raises KeyError, TypeError or ValueError where the files are not as written."""
    attitude = columns(directory / "attitude.csv", ATTITUDE_COLUMNS)
    if len(attitude["t_s"]) != len(fit["attitude"]["t_s"]):
        raise ValueError("fit.json and attitude.csv differ in their number of times")
    stems, notes = file_stems(fit["channels"]), provenance["notes"]
    tables = {n: columns(directory / f"{s}.csv", provenance["columns"][f"{s}.csv"]) for n, s in stems.items()}
    return FitResult(
        status=fit["status"],
        message=fit["message"],
        verdict=fit["verdict"][0],
        remarks=tuple(fit["verdict"][2:]),
        chi2=fit["chi2"],
        dof=fit["dof"],
        parameters=tuple(FittedParameter(name, note=notes.get(name, ""), **p) for name, p in fit["parameters"].items()),
        buys=fit["buys"],
        correlations=fit["correlations"],
        t_s=attitude["t_s"],
        quaternion_inertial_from_body=_stack(attitude, [f"q_{c}" for c in "wxyz"]),
        angular_velocity_rad_s=_stack(attitude, [f"rate_{c}_rad_s" for c in "xyz"]),
        attitude_sigma_deg=_stack(attitude, [f"attitude_sigma_{c}_deg" for c in "xyz"]),
        illumination=_known(attitude["lit"]),
        fitted=attitude["fitted"] > 0.5,
        channels={name: _channel(name, fit, table) for name, table in tables.items()},
        axes=fit["axes"],
        alternatives=tuple(fit["alternatives"]),
        causes=tuple(Cause(**each) for each in fit.get("causes", ())),
        timing_s=fit["timing_s"],
        field_angle_deg=_known(attitude["field_angle_deg"]),
        field_angle_sigma_deg=_known(attitude["field_angle_sigma_deg"]),
        limited=_flags(attitude["limited"]),
        unseen=tuple(Direction(**{k: v for k, v in each.items() if k != "blind"}) for each in fit["unseen"]),
        gauge=fit["gauge"],
    )


def _channel(name: str, fit: dict, table: dict[str, np.ndarray]) -> ChannelFit:
    known, delay = fit["channels"][name], fit["delays"].get(name, {"from": "fit"})
    witness = known["role"] == "witness"
    told = (fit["witness" if witness else "holdout"] or {}).get(name) or {}
    numbers = ("count", "outliers", "rms", "promised_rms", "angle_deg", "directions")
    breaks = [b for each in fit["breaks"] if each["channel"] == name for b in each["breaks"]]
    shown = delay["from"] == "residuals"
    parts = {part: [v for key, v in table.items() if key.startswith(f"{part}_")] for part in ARRAYS + FURTHER}
    arrays: dict[str, Any] = {
        part: np.column_stack(found) if found else None for part, found in parts.items() if found or part in FURTHER
    }
    diagnostics = fit["diagnostics"]["channels"].get(name, {"columns": {}})
    return ChannelFit(
        name=name,
        kind=known["kind"],
        unit=known["unit"],
        columns=tuple(known["columns"]),
        t_s=table["t_s"],
        **arrays,
        sigma=known["sigma"],
        fitted=table["fitted"] > 0.5,
        used=table["used"] > 0.5,
        rms=fit["residual_rms"][name]["value"],
        chi2_per_reading=known["chi2_per_reading"],
        angle_deg=known["angle_deg"],
        holdout=Holdout(*(told[key] for key in numbers if key in told)) if "rms" in told else None,
        delay_s=delay["value"] if shown else None,
        delay_sigma_s=delay["sigma"] if shown else None,
        breaks=tuple(Break(**{**each, "left": tuple(each["left"])}) for each in breaks),
        residuals=tuple(PanelResiduals(**each) for each in diagnostics["columns"].values()),
        witness=witness,
        wish=Wish(**told["wish"]) if told.get("wish") else None,
    )


def _stack(columns: dict[str, np.ndarray], names: Iterable[str]) -> np.ndarray:
    return np.column_stack([columns[name] for name in names])


def _flags(values: np.ndarray) -> np.ndarray | None:
    return values > 0.5 if np.isfinite(values).any() else None


def _known(values: np.ndarray) -> np.ndarray | None:
    return values if np.isfinite(values).any() else None
