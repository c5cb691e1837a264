"""The files of a fit: fit.json (schema `jaxsat.fit/1`), attitude.csv and currents.csv."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.files.csv_files import write_numbers_csv
from jaxsat.files.json_files import plain
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.telemetry import MatchedLimbAngles
from jaxsat.time import Epoch

if TYPE_CHECKING:
    from fitting.outcome.currents_diagnostics import Diagnostics
    from fitting.outcome.result import FitResult
    from fitting.profile.profile import Profile

SCHEMA = "jaxsat.fit/1"
TIMINGS = ("import", "prepare", "compile", "solve", "total")

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
    **{f"measured_{p}_mA": "panel current after cleaning" for p in PANEL_NAMES},
    **{f"modelled_{p}_mA": "fitted current, direct sunlight and albedo" for p in PANEL_NAMES},
    **{f"direct_{p}_mA": "the part of direct sunlight in it" for p in PANEL_NAMES},
    **{f"weight_{p}": "final weight, 0 = left out" for p in PANEL_NAMES},
}
"""Columns of currents.csv."""


def fit_document(
    result: "FitResult",
    *,
    telemetry: str,
    epoch: Epoch,
    diagnostics: "Diagnostics",
    profiles: Sequence["Profile"] = (),
    limb: dict[str, Any] | None = None,
    witness: dict[str, Any] | None = None,
    orbit: dict[str, Any] | None = None,
) -> tuple[dict[str, Any], list[str]]:
    """Returns the content of fit.json, and the places in it where a number that is not finite became null.

    The key `limb` is there only where limb angles were fitted, `witness` where a sensor that was not fitted says
    whether it confirms the motion; `orbit` is that of `orbit_states`.
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
        **({} if witness is None else {"witness": witness}),
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


def limb_document(matched: MatchedLimbAngles, result: "FitResult") -> dict[str, Any]:
    """Returns the key `limb` of fit.json; rows of samples before or after the fitted ones are outside its arc."""
    rows, unmatched = len(matched.file.row), len(matched.unmatched)
    return {
        "rows_used": result.limb_samples,
        "rows_unmatched": unmatched,
        "rows_outside_arc": rows - unmatched - result.limb_samples,
        "rms_deg": result.limb_rms_deg,
    }
