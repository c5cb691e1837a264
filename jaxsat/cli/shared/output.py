"""The files of a fit: fit.json (schema `jaxsat.fit/1`), attitude.csv and currents.csv."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.time import Epoch

if TYPE_CHECKING:
    from fitting.outcome.diagnostics import Diagnostics
    from fitting.outcome.profile import Profile
    from fitting.outcome.result import FitResult
    from jaxsat.telemetry.raw_sun.cleaning import Session

SCHEMA = "jaxsat.fit/1"
TIMINGS = ("import", "prepare", "compile", "solve", "total")
PANELS = ("+x", "-x", "+y", "-y", "+z", "-z")

ATTITUDE_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    **{f"q_{c}": "attitude quaternion, scalar first, turns body axes into inertial ones" for c in "wxyz"},
    **{f"rate_{c}_rad_s": "angular velocity about the body axes" for c in "xyz"},
    **{f"attitude_sigma_{c}_deg": "1-sigma of a small rotation about the body axes" for c in "xyz"},
    "field_angle_deg": "angle between body x and the magnetic field",
    "field_angle_sigma_deg": "its 1-sigma",
    "lit": "1 outside the Earth's shadow",
    "limited": "1 where the fit left the whole sample out as current-limited or outlying",
}
"""Columns of attitude.csv; an empty field stands for a number that is not known."""

CURRENT_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    **{f"measured_{p}_mA": "panel current after cleaning" for p in PANELS},
    **{f"modelled_{p}_mA": "fitted current, direct sunlight and albedo" for p in PANELS},
    **{f"direct_{p}_mA": "the part of direct sunlight in it" for p in PANELS},
    **{f"weight_{p}": "final weight, 0 = left out" for p in PANELS},
}
"""Columns of currents.csv."""

SAMPLE_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    **{f"position_{c}_km": "position, inertial equatorial axes" for c in "xyz"},
    **{f"velocity_{c}_km_s": "velocity, inertial equatorial axes" for c in "xyz"},
    **{f"current_{p}_mA": "panel current" for p in PANELS},
    **{f"field_{c}_uT": "magnetometer, body axes; empty where there is no reading" for c in "yz"},
    "rows": "rows of the file averaged into the sample",
}
"""Columns of samples.csv."""


def fit_document(
    result: "FitResult",
    *,
    telemetry: str,
    epoch: Epoch,
    diagnostics: "Diagnostics",
    profiles: Sequence["Profile"] = (),
    limb: dict[str, Any] | None = None,
    orbit: dict[str, Any] | None = None,
) -> tuple[dict[str, Any], list[str]]:
    """Returns the content of fit.json, and the places in it where a number that is not finite became null.

    The key `limb` is there only where limb angles were fitted; `orbit` is that of `jaxsat.cli.session.orbit_document`.
    """
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "telemetry": telemetry,
        "epoch_utc": epoch.iso(3),
        "status": result.status,
        "message": result.message,
        "chi2": result.chi2,
        "dof": result.dof,
        "residual_rms_mA": result.residual_rms_mA,
        **({} if limb is None else {"limb": limb}),
        "parameters": {
            p.name: {"value": p.value, "sigma": p.sigma if p.free else None, "unit": p.unit, "free": p.free}
            for p in result.parameters
        },
        "gauge": result.gauge,
        "unseen": [direction.as_dict() for direction in result.unseen],
        "correlations": result.correlations,
        "attitude": {
            "t_s": result.t_s,
            "quaternion_inertial_from_body": result.quaternion_inertial_from_body,
            "angular_velocity_rad_s": result.angular_velocity_rad_s,
            "field_angle_deg": result.field_angle_deg,
            "field_angle_sigma_deg": result.field_angle_sigma_deg,
        },
        **({} if orbit is None else {"orbit": orbit}),
        "diagnostics": diagnostics.as_dict(),
        "profiles": {p.name: p.as_dict() for p in profiles},
        "timing_s": {name: result.timing_s.get(name, 0.0) for name in TIMINGS},
    }
    return plain(document)


def plain(document: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Returns a document in plain Python, and the places where a number that is not finite became null."""
    nulls: list[str] = []
    return _plain(document, "", nulls), nulls


def _plain(value: Any, place: str, nulls: list[str]) -> Any:
    """NumPy to plain Python; a number that is not finite becomes None and its place is noted, a list once."""
    if isinstance(value, dict):
        return {str(key): _plain(item, f"{place}.{key}" if place else str(key), nulls) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item, place, nulls) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        if place not in nulls:
            nulls.append(place)
        return None
    return value


def json_text(document: dict[str, Any]) -> str:
    """Returns strict JSON with one key a line and each list on one line, or one row a line where it holds lists.

    Raises `ValueError` for a number that is not finite.
    """
    return _json(document, "") + "\n"


def _json(value: Any, indent: str) -> str:
    deeper = indent + "  "
    if isinstance(value, dict) and value and any(isinstance(item, dict | list) for item in value.values()):
        items = [f"{deeper}{json.dumps(str(key))}: {_json(item, deeper)}" for key, item in value.items()]
        return "{\n" + ",\n".join(items) + f"\n{indent}}}"
    if isinstance(value, list) and value and isinstance(value[0], list | dict):
        if all(type(item) is list and item and type(item[0]) is float for item in value):
            # Tables of numbers are long, and one call for all rows takes a fifth of the time of one a row.
            rows = json.dumps(value, allow_nan=False)[1:-1].replace("], [", f"],\n{deeper}[")
        else:
            rows = f",\n{deeper}".join(_json(item, deeper) for item in value)
        return f"[\n{deeper}{rows}\n{indent}]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Writes strict JSON, UTF-8."""
    path.write_text(json_text(document), encoding="utf-8")


def write_attitude_csv(path: Path, result: "FitResult", epoch: Epoch) -> None:
    """Writes one row a sample with the columns of `ATTITUDE_COLUMNS`."""
    numbers = np.column_stack(
        [
            result.quaternion_inertial_from_body,
            result.angular_velocity_rad_s,
            result.attitude_sigma_deg,
            result.field_angle_deg,
            result.field_angle_sigma_deg,
            result.lit,
            result.limited,
        ]
    )
    write_numbers_csv(path, ATTITUDE_COLUMNS, result.t_s, epoch, numbers)


def write_currents_csv(path: Path, result: "FitResult", epoch: Epoch) -> None:
    """Writes one row a sample with the columns of `CURRENT_COLUMNS`."""
    numbers = np.hstack([result.measured_mA, result.modelled_mA, result.modelled_direct_mA, result.weight])
    write_numbers_csv(path, CURRENT_COLUMNS, result.t_s, epoch, numbers)


def write_samples_csv(path: Path, session: "Session") -> None:
    """Writes a cleaned session, one row a sample, with the columns of `SAMPLE_COLUMNS`."""
    kilometres = session.position_eci_m / 1e3, session.velocity_eci_m_s / 1e3
    numbers = np.column_stack([*kilometres, session.currents_mA, session.b_field_uT, session.repeats])
    write_numbers_csv(path, SAMPLE_COLUMNS, session.t_s, session.epoch, numbers)


def write_columns_csv(path: Path, t_s: np.ndarray, epoch: Epoch, columns: Mapping[str, np.ndarray]) -> None:
    """Writes `t_s`, `utc` and named columns [time], units in their names; an empty field is a number not known."""
    numbers = np.column_stack(list(columns.values()))
    write_numbers_csv(path, ["t_s", "utc", *columns], t_s, epoch, numbers)


def write_numbers_csv(path: Path, columns: Iterable[str], t_s: np.ndarray, epoch: Epoch, numbers: np.ndarray) -> None:
    """Writes one row of `numbers` [time fields] a time, with its time and UTC in front; see `csv_numbers`."""
    rows = zip(csv_numbers(t_s[:, None]), epoch.iso_texts(t_s), csv_numbers(numbers), strict=True)
    with path.open("w", newline="", encoding="utf-8") as stream:
        stream.write(",".join(columns) + "\n")
        stream.writelines(f"{t},{utc},{row}\n" for t, utc, row in rows)


def csv_numbers(numbers: np.ndarray) -> list[str]:
    """Returns the fields of each row with ten digits and commas between; a number that is not finite is empty."""
    pattern = ",".join(["%.10g"] * numbers.shape[1])
    texts = [pattern % tuple(row) for row in numbers.tolist()]
    for k in np.flatnonzero(~np.isfinite(numbers).all(axis=1)):
        texts[k] = ",".join(f"{x:.10g}" if math.isfinite(x) else "" for x in numbers[k])
    return texts
