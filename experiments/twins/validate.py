"""Compares the generator with sessions of another one: motion and noise-free readings from the `cfg` of their truth.

    .venv/bin/python -m experiments.twins.validate SESSION.truth.json ... [--out FILE.json]

For each session: the largest angle between the attitudes over the arc, and for each sensor the residuals of the table
over their sigma (root mean square: one; a unit vector 0.82, for its noise along the vector is lost).
"""

import argparse
import csv
import datetime as dt
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.twins.draw import start_of
from experiments.twins.motion import Motion
from experiments.twins.sensors import UNITS, readings
from experiments.twins.world import World

Array = NDArray[np.float64]


def angles(q: Array, other: Array) -> Array:
    """Between attitudes [n 4], rad, accurate near zero too."""
    apart = np.minimum(np.linalg.norm(q - other, axis=1), np.linalg.norm(q + other, axis=1))
    return 4.0 * np.arcsin(np.clip(0.5 * apart, 0.0, 1.0))


def read_table(file: Path, form: str, epoch: dt.datetime) -> tuple[Array, dict[str, Array]]:
    """Stamps since the epoch [s] and the columns of a table by name, NaN where a cell is empty."""
    with file.open(newline="") as stream:
        head, *rows = csv.reader(stream)
    zero = epoch.replace(tzinfo=dt.UTC)
    read = {
        "seconds": float,
        "unix": lambda text: float(text) - zero.timestamp(),
        "iso": lambda text: (dt.datetime.fromisoformat(text) - zero).total_seconds(),
    }[form]
    values = np.array([[float(cell or "nan") for cell in row[1:]] for row in rows])
    return np.array([read(row[0]) for row in rows]), dict(zip(head[1:], values.T, strict=True))


def compare(truth: dict[str, Any], table: Path) -> dict[str, Any]:
    """Angle and rate between the motions, and RMS of residuals over sigma by sensor."""
    cfg = truth["cfg"]
    epoch = dt.datetime.fromisoformat(cfg["epoch"])
    t, columns = read_table(table, cfg.get("time_form", "iso"), epoch)
    commands = [name for name in columns if name.startswith("coil")]
    if commands and "coils" not in cfg:
        # Their truth leaves the commands to the table and the coils to the satellite file: 2 m2 along each axis.
        cfg["coils"] = [{"axis": axis, "area_turns_m2": 2.0} for axis in np.eye(3).tolist()]
        cfg["commands"] = {"t": t.tolist(), "current": np.stack([columns[name] for name in commands], 1).tolist()}
    fine = {name: np.array(values) for name, values in truth["fine"].items()}
    first, second = cfg["orbit"]["tle"]
    world = World((first, second), epoch, start_of(cfg), float(fine["t"][-1]))
    motion = Motion(cfg, world)
    inside = fine["t"] <= cfg["duration"]
    q, w = motion(fine["t"][inside])
    found: dict[str, Any] = {
        "session": truth["name"],
        "attitude_rad": float(angles(q, fine["q"][inside]).max()),
        "rate_rad_s": float(np.abs(w - fine["w"][inside]).max()),
        "field_nT": float(1e9 * np.abs(world.field(fine["t"]) - fine["b_inertial_T"]).max()),
        "illumination": float(np.abs(world.illumination(np.array(truth["t"])) - truth["illumination"]).max()),
        "residual_over_sigma": {},
    }
    for name, sensor in cfg["sensors"].items():
        values = UNITS[sensor["unit"]] * np.stack([columns[column] for column in sensor["columns"]], axis=1)
        known = ~np.isnan(values).any(axis=1) & ~np.isin(t, truth["spoilt"][name])
        means = readings(sensor, t[known] - sensor.get("late", 0.0), motion, world, cfg["albedo"])
        measured = values[known]
        if sensor["kind"] == "star_tracker":
            measured = measured * np.sign(np.sum(measured * means, axis=1, keepdims=True))
        found["residual_over_sigma"][name] = float(np.sqrt(np.mean(((measured - means) / sensor["sigma"]) ** 2)))
    return found


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("truth", type=Path, nargs="+", help="SESSION.truth.json, its table beside it")
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    found = []
    for file in asked.truth:
        each = compare(json.loads(file.read_text()), file.with_name(file.name.replace(".truth.json", ".csv")))
        found.append(each)
        residuals = "  ".join(f"{name} {value:.3f}" for name, value in each["residual_over_sigma"].items())
        print(
            f"{each['session']:<16} attitude {each['attitude_rad']:.1e} rad  rate {each['rate_rad_s']:.1e} rad/s  "
            f"field {each['field_nT']:.3f} nT  light {each['illumination']:.1e}  residual over sigma: {residuals}"
        )
    if asked.out:
        asked.out.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
