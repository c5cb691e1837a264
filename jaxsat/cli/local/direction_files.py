"""The files of `jaxsat local --satellite`: attitude.csv, local.json (schema `jaxsat.local/1`) and a picture."""

import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.cli.local.files import SCHEMA
from jaxsat.files.csv_files import csv_numbers
from jaxsat.files.json_files import plain, write_json

if TYPE_CHECKING:
    from fitting.local.directions import DirectAttitudes
    from jaxsat.telemetry import TableSession

CONVENTION = "q: quaternion, scalar first, turns body axes into inertial ones (true equator and equinox of date)"
COLUMNS = {
    "t_s": "seconds since the epoch, the sensors' delays of the satellite file taken off",
    "utc": "UTC",
    **{
        f"q_{c}": "attitude, scalar first, turns body axes into inertial ones; empty where there is none"
        for c in "wxyz"
    },
    "sigma_deg": "1-sigma of the attitude about its least seen axis",
    **{f"rate_{c}_deg_s": "by the shorter turns to the neighbouring attitudes, body axes" for c in "xyz"},
    "mismatch_deg": "angle between two directions in the body less that outside; of several pairs the worst",
    "mismatch_sigma_deg": "1-sigma of it by the sensors and 3 deg of their calibration",
    "seen": "sensors that see a direction or stars, with those carried between two near readings",
    "status": "solved, inconsistent, undetermined or unsolved",
    "reason": "why it is not solved",
}
"""Columns of attitude.csv, one row a sample."""


def write_directions(
    directory: Path,
    found: "DirectAttitudes",
    session: "TableSession",
    satellite: Path,
    *,
    began: float,
    plots: bool,
) -> None:
    """Writes all files; `began` is when the command did, of perf_counter."""
    epoch = session.epoch
    numbers = _numbers(found)
    table = csv_numbers(np.column_stack(list(numbers.values())))
    rows = zip(csv_numbers(found.t[:, None]), epoch.iso_texts(found.t), table, strict=True)
    with (directory / "attitude.csv").open("w", newline="", encoding="utf-8") as stream:
        stream.write(",".join(COLUMNS) + "\n")
        for (t, utc, row), seen, status, reason in zip(rows, found.seen, found.status, found.reason, strict=True):
            stream.write(f"{t},{utc},{row},{' '.join(seen)},{status},{reason}\n")
    if plots:
        from jaxsat.plotting import draw_direct_attitudes, png_bytes

        figure = draw_direct_attitudes(
            found.t,
            np.degrees(found.rate),
            *(np.degrees(each) for each in (found.mismatch, found.mismatch_sigma, found.sigma)),
            status=np.array(found.status),
            subtitle=f"{session.name}, {epoch.iso(0)} UTC",
        )
        (directory / "attitude.png").write_bytes(png_bytes(figure))
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "telemetry": ", ".join(str(path) for path in session.paths),
        "sha256": ", ".join(session.sha256),
        "epoch_utc": epoch.iso(3),
        "method": "directions",
        "satellite": str(satellite),
        "convention": CONVENTION,
        "axes": [{"axes": each.spelt(), "mismatch_sigma": each.mismatch} for each in found.conventions if each.axes],
        "status_counts": dict(Counter(found.status)),
        "reasons": dict(Counter(reason for reason in found.reason if reason)),
        "samples": _samples(found),
        "timing_s": {"total": time.perf_counter() - began},
    }
    write_json(directory / "local.json", plain(document)[0])


def _numbers(found: "DirectAttitudes") -> dict[str, np.ndarray]:
    return {
        "quaternion_inertial_from_body": found.quaternion,
        "sigma_deg": np.degrees(found.sigma),
        "rate_deg_s": np.degrees(found.rate),
        "mismatch_deg": np.degrees(found.mismatch),
        "mismatch_sigma_deg": np.degrees(found.mismatch_sigma),
    }


def _samples(found: "DirectAttitudes") -> list[dict[str, Any]]:
    """As of the other methods, a list of solutions each: here one or none."""
    values = {name: column.tolist() for name, column in _numbers(found).items()}
    solved = found.solved
    return [
        {
            "t_s": instant,
            "status": found.status[k],
            "reason": found.reason[k],
            "seen": list(found.seen[k]),
            "solutions": [{name: column[k] for name, column in values.items()}] if solved[k] else [],
        }
        for k, instant in enumerate(found.t.tolist())
    ]
