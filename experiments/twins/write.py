"""Table, element set, satellite file and truth of a session, in the format of the flight data that the fit reads."""

import datetime as dt
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.twins.draw import SATELLITES, start_of, stream
from experiments.twins.motion import Motion
from experiments.twins.sensors import UNITS, measure
from experiments.twins.world import World

Array = NDArray[np.float64]

BEYOND = 1.1
"""How far the truth reaches, in durations of the session."""


def write_session(cfg: dict[str, Any], folder: Path) -> Path:
    """Makes the session of `cfg` (see `draw`) and writes its four files; answers the path of the table."""
    name, epoch = cfg["name"], dt.datetime.fromisoformat(cfg["epoch"])
    first, second = cfg["orbit"]["tle"]
    world = World((first, second), epoch, start_of(cfg), BEYOND * cfg["duration"])
    motion = Motion(cfg, world)
    rng = stream(cfg["preset"], cfg["seed"], 1)
    measured = {
        channel: measure(sensor, motion, world, albedo=cfg["albedo"], duration=cfg["duration"], rng=rng)
        for channel, sensor in cfg["sensors"].items()
    }
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / f"{name}.csv"
    t = np.unique(np.concatenate([np.round(stamps, 6) for stamps, _, _ in measured.values()]))
    table.write_text(_table(cfg, t, measured))
    (folder / f"{name}.tle").write_text("\n".join([name.upper(), *cfg["orbit"]["tle"]]) + "\n")
    satellite = (SATELLITES / f"{cfg['preset']}.toml").read_text()
    (folder / f"{name}.sat.toml").write_text(satellite.replace("NAME", name))
    spoilt = {channel: bad.tolist() for channel, (_, _, bad) in measured.items()}
    (folder / f"{name}.truth.json").write_text(json.dumps(truth(cfg, world, motion, t, spoilt)))
    return table


def _table(cfg: dict[str, Any], t: Array, measured: dict[str, tuple[Array, Array, Array]]) -> str:
    cells: dict[float, dict[str, str]] = {}
    for channel, (stamps, values, _) in measured.items():
        sensor = cfg["sensors"][channel]
        for stamp, row in zip(np.round(stamps, 6), values / UNITS[sensor["unit"]], strict=True):
            if not np.isnan(row).any():
                if "quantum" in sensor:
                    row = sensor["quantum"] * np.round(row / sensor["quantum"])
                text = (f"{value:.{sensor['digits']}f}" for value in row)
                cells.setdefault(stamp, {}).update(zip(sensor["columns"], text, strict=True))
    coils, columns = cfg.get("coils", []), [c for sensor in cfg["sensors"].values() for c in sensor["columns"]]
    column = {"iso": "utc", "unix": "unix_s", "seconds": "t"}[cfg["time_form"]]
    lines = [",".join([column, *columns, *(coil["column"] for coil in coils)])]
    for stamp in t:
        if stamp in cells:
            row = [cells[stamp].get(name, "") for name in columns]
            row += [f"{current:.6f}" for current in _currents(cfg, stamp)] if coils else []
            lines.append(",".join([_stamp(cfg, float(stamp)), *row]))
    return "\n".join(lines) + "\n"


def _currents(cfg: dict[str, Any], t: float) -> list[float]:
    held = int(np.searchsorted(cfg["commands"]["t"], t, side="right")) - 1
    return cfg["commands"]["current"][held] if held >= 0 else [0.0] * len(cfg["coils"])


def _stamp(cfg: dict[str, Any], t: float) -> str:
    digits = cfg["time_digits"]
    if cfg["time_form"] == "seconds":
        return f"{t:.{digits}f}"
    at = dt.datetime.fromisoformat(cfg["epoch"]).replace(tzinfo=dt.UTC) + dt.timedelta(seconds=t)
    if cfg["time_form"] == "unix":
        return f"{at.timestamp():.{digits}f}"
    return at.isoformat(timespec="milliseconds" if digits else "seconds").replace("+00:00", "Z")


def truth(
    cfg: dict[str, Any], world: World, motion: Motion, t: Array, spoilt: dict[str, list[float]]
) -> dict[str, Any]:
    """What the truth file says: motion at the stamps `t` and between and beyond them, and all true numbers."""
    fine = np.arange(0.0, BEYOND * cfg["duration"] + 1e-9, cfg["fine_s"])
    (q, w), (fine_q, fine_w) = motion(t), motion(fine)
    return {
        "schema": "truth_any/1",
        "name": cfg["name"],
        "preset": cfg["preset"],
        "seed": cfg["seed"],
        "epoch_utc": cfg["epoch"],
        "duration_s": cfg["duration"],
        "t": t.tolist(),
        "q": q.tolist(),
        "w": w.tolist(),
        "fine": {
            "t": fine.tolist(),
            "q": fine_q.tolist(),
            "w": fine_w.tolist(),
            "b_inertial_T": np.round(world.field(fine), 12).tolist(),
        },
        "illumination": np.round(world.illumination(t), 4).tolist(),
        "frame": "true of date",
        "tod_from_gcrs": world.of_date_from_gcrs.tolist(),
        "gast0": float(world.greenwich(0.0)),
        "spoilt": spoilt,
        "sensors": cfg["sensors"],
        "parameters": parameters(cfg, motion(np.zeros(1))[1][0]),
        "gaps": [],
        "wrong_model": None,
        # Coils of known moment alone tell a moment from an inertia.
        "absolute_scale": "coils" in cfg,
        "cfg": cfg,
    }


def parameters(cfg: dict[str, Any], rate: Array) -> dict[str, dict[str, Any]]:
    """Every true number by the name that a fit gives it; `group` joins those of which only ratios may be seen."""
    scaled = {f"inertia.{'xyz'[i]}{'xyz'[j]}": (cfg["inertia"][i][j], "kg m2") for i, j in _UPPER}
    scaled |= _by_axis("magnet", cfg["magnet"], "A m2") | _by_axis("residual", cfg.get("residual", [0.0] * 3), "N m")
    scaled["eddy"] = (cfg.get("eddy", 0.0), "S m4")
    found = _by_axis("rate", rate.tolist(), "rad/s") | {"albedo.diffuse": (cfg["albedo"], "1")}
    for k, rod in enumerate(cfg.get("rods", [])):
        units = {"moment": "A m2", "volume": "m3", "Hc": "A/m", "Br": "T", "Bs": "T"}
        for key in set(rod) & set(units):
            group = scaled if key in ("moment", "volume") else found
            group[f"rods.{k}.{key}"] = (rod[key], units[key])
    for name, sensor in cfg["sensors"].items():
        found |= {f"{name}.{key}": each for key, each in _of_sensor(sensor).items()}
    said = {name: {"value": value, "unit": unit, "group": "scale"} for name, (value, unit) in sorted(scaled.items())}
    return said | {name: {"value": value, "unit": unit} for name, (value, unit) in sorted(found.items())}


_UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _by_axis(name: str, values: list[float], unit: str) -> dict[str, tuple[float, str]]:
    return {f"{name}.{axis}": (value, unit) for axis, value in zip("xyz", values, strict=True)}


def _of_sensor(sensor: dict[str, Any]) -> dict[str, tuple[float, str]]:
    found: dict[str, tuple[float, str]] = {"delay": (sensor.get("late", 0.0), "s")}
    if "bias" in sensor:
        found |= _by_axis("bias", sensor["bias"], "rad/s" if sensor["kind"] == "gyro" else "T")
        found |= _by_axis("scale", sensor.get("scale", [1.0] * 3), "1")
        found |= _by_axis("turn", np.radians(sensor.get("turn_deg", [0.0] * 3)).tolist(), "rad")
    if "stray" in sensor:
        for face in ("+x", "-x", "+y", "-y", "+z", "-z"):
            found |= _by_axis(f"stray.{face}", sensor["stray"].get(face, [0.0] * 3), "T")
    for k, (gain, normal) in enumerate(zip(sensor.get("gain", []), sensor.get("normals", []), strict=True)):
        found[f"gain.{normal if isinstance(normal, str) else k}"] = (gain, "1")
    if "limit_deg" in sensor:
        found |= {"limit": (float(np.radians(sensor["limit_deg"])), "rad"), "exponent": (sensor["exponent"], "1")}
    if "imax" in sensor:
        found["imax"] = (sensor["imax"], "A")
    return found
