"""A random session of a kind: true numbers about those of its satellite file, motion, orbit and axes.

Answers the dictionary that the truth file keeps as `cfg`, from which motion and readings follow. Session SEED of a kind
is the same whatever else is made.
"""

import datetime as dt
import itertools
import tomllib
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from experiments.twins.presets import PRESETS, Preset
from experiments.twins.sensors import UNITS
from experiments.twins.world import World

Array = NDArray[np.float64]
SATELLITES = Path(__file__).parent / "satellites"

EPOCH = dt.datetime(2020, 11, 21, 20, 58, 1)
ELEMENTS = (
    "1 99001U 21001A   20326.72226509  .00001924  00000-0  13588-3 0  999",
    "2 99001  82.1924 {node:8.4f} {eccentricity:07d} {perigee:8.4f} {anomaly:8.4f} 15.40668907    1",
)
"""Both lines but for the checksum."""
SPREAD, FURTHEST = 1.0, 2.5
"""Scatter of true values over the sigmas of the satellite files, and the furthest scatter that is drawn."""
EARLY_S = 10.0
INERTIA_TURN_DEG = 1.0
"""Of the principal axes about each body axis."""


def draw(kind: str, seed: int, spread: float = SPREAD) -> dict[str, Any]:
    """Settings of session `seed` of a kind."""
    preset = PRESETS[kind]
    file = tomllib.loads((SATELLITES / f"{kind}.toml").read_text())
    rng = stream(kind, seed, 0)
    cfg: dict[str, Any] = {
        "preset": kind,
        "name": f"{kind}-{seed}",
        "seed": seed,
        "epoch": EPOCH.isoformat(),
        "duration": preset.duration,
        "time_form": file["time"]["form"],
        "time_digits": preset.time_digits,
        "fine_s": preset.fine_s,
        "start_early": preset.start_early,
        "inertia": _inertia(file["body"]["inertia_kg_m2"], spread, rng),
        "magnet": (preset.dipole * rng.uniform(0.6, 1.4) * _direction(rng)).tolist(),
        "q0": rng.standard_normal(4),
        "w0": (np.radians(preset.spin_deg_s) * rng.uniform(0.7, 1.3) * _direction(rng)).tolist(),
        "albedo": float(np.clip(_about(file.get("albedo", {}).get("diffuse", 0.3), spread, rng), 0.05, 0.8)),
    }
    cfg["q0"] = (cfg["q0"] / np.linalg.norm(cfg["q0"])).tolist()
    _parts(cfg, file, preset, spread, rng)
    cfg["sensors"] = {
        name: _sensor(sensor, file["channels"][name], preset.sensors[name], spread, rng)
        for name, sensor in file["sensors"].items()
    }
    if "limited_s" in preset.extra:
        start = float(rng.uniform(0.15, 0.5) * preset.duration)
        cells = cfg["sensors"]["cells"]
        cells["limit"] = [start, start + preset.extra["limited_s"], float(rng.uniform(0.75, 0.95) * cells["imax"])]
    cfg["orbit"] = {"kind": "sgp4", "tle": _orbit(preset, rng)}
    return cfg


def stream(kind: str, seed: int, use: int) -> np.random.Generator:
    """Random numbers of one session: `use` 0 draws it, 1 is its noise."""
    return np.random.default_rng([seed, zlib.crc32(kind.encode()), use])


def start_of(cfg: dict[str, Any]) -> float:
    """When the motion starts from `q0` and `w0` [s]: before the epoch where a sensor is late or the rods need it."""
    late = any(sensor.get("late") for sensor in cfg["sensors"].values())
    return -EARLY_S if late or cfg.get("start_early") else 0.0


def _direction(rng: np.random.Generator) -> Array:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _scatter(shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    return np.clip(rng.standard_normal(shape), -FURTHEST, FURTHEST)


def _about(given: Any, spread: float, rng: np.random.Generator) -> Any:
    """True value of a number or an array of a satellite file; what is given without sigma is exact."""
    if not isinstance(given, dict):
        return given
    value = np.array(given["value"], float)
    return (value + spread * given["sigma"] * _scatter(value.shape, rng)).tolist()


def _inertia(given: dict[str, Any], spread: float, rng: np.random.Generator) -> list[list[float]]:
    nominal = np.diag(given["value"])
    share = given["sigma"] / nominal.max()
    while True:
        moments = nominal * (1.0 + spread * share * _scatter((3,), rng))
        # A body of positive mass: no moment is larger than the sum of the others.
        if 2.0 * moments.max() < moments.sum():
            break
    turn = Rotation.from_rotvec(np.radians(INERTIA_TURN_DEG) * rng.standard_normal(3)).as_matrix()
    inertia = turn @ np.diag(moments) @ turn.T
    return (0.5 * (inertia + inertia.T)).tolist()


def _parts(cfg: dict[str, Any], file: dict[str, Any], preset: Preset, spread: float, rng: np.random.Generator) -> None:
    if "rods" in file:
        cfg["rods"] = [{key: _about(value, spread, rng) for key, value in rod.items()} for rod in file["rods"]]
        for rod in cfg["rods"]:
            rod.update({"moment": abs(rod["moment"])} if "moment" in rod else {})
    if "eddy" in file:
        cfg["eddy"] = abs(_about(file["eddy"]["coefficient"], spread, rng))
    if "residual" in file:
        cfg["residual"] = _about(file["residual"]["torque"], spread, rng)
    if "coils" in file:
        cfg["coils"] = file["coils"]
        held, current = preset.extra["held_s"], preset.extra["current_A"]
        count = round(preset.extra["commanded_s"] / held)
        # On a row, so that the table tells the moment of the change.
        start = 5.0 * rng.integers(int(0.04 * preset.duration), int(0.09 * preset.duration))
        levels = current * rng.integers(-1, 2, (count, len(cfg["coils"])))
        cfg["commands"] = {
            "t": (start + held * np.arange(count + 1)).tolist(),
            "current": [*levels.tolist(), [0.0] * len(cfg["coils"])],
        }


def _sensor(
    file: dict[str, Any], channel: dict[str, Any], table: dict[str, Any], spread: float, rng: np.random.Generator
) -> dict[str, Any]:
    """Truth of a sensor: kind, columns, cadence and noise, and its own numbers in SI."""
    in_table, in_file = UNITS[channel["unit"]], UNITS[file.get("unit", "1")]
    sensor: dict[str, Any] = {"kind": file["kind"], "columns": channel["columns"], "unit": channel["unit"], **table}
    sensor["sigma"] = channel["sigma"] * in_table
    if "quantum" in channel:
        sensor["quantum"] = channel["quantum"]
    if "delay_s" in channel:
        sensor["late"] = float(rng.uniform(0.5, 1.5))
    for key in ("normals", "response", "unit_vector"):
        if key in file:
            sensor[key] = file[key]
    for key in ("gain", "scale", "limit_deg"):
        if key in file:
            sensor[key] = _about(file[key], spread, rng)
    if "exponent" in file:
        sensor["exponent"] = float(np.clip(_about(file["exponent"], spread, rng), 1.0, 4.0))
    for key in ("bias", "imax"):
        if key in file:
            sensor[key] = (np.array(_about(file[key], spread, rng)) * in_file).tolist()
    if "turn" in file:
        sensor["turn_deg"] = np.degrees(_about(file["turn"], spread, rng)).tolist()
    if "stray" in file:
        face = "xyz"[rng.integers(3)]
        size = spread * file["stray"]["sigma"] * in_file
        sensor["stray"] = {"+-"[rng.integers(2)] + face: (size * _scatter((3,), rng)).tolist()}
    if file.get("unit_vector"):
        _without_size(sensor)
    if "axes" in file:
        sensor["axes"] = _any_axes(rng) if file["axes"] == "unknown" else file["axes"]
    return sensor


def _without_size(sensor: dict[str, Any]) -> None:
    """Where only a direction is sent, scale, bias and stray field have one free factor: here the first scale is one."""
    factor = sensor["scale"][0]
    sensor["scale"] = [scale / factor for scale in sensor["scale"]]
    sensor["bias"] = [bias / factor for bias in sensor["bias"]]
    sensor["stray"] = {face: [value / factor for value in stray] for face, stray in sensor["stray"].items()}


def _any_axes(rng: np.random.Generator) -> list[str]:
    """One of the 24 right-handed orders and signs of the body's axes."""
    choices = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.array(signs)[:, None] * np.eye(3)[list(order)]
            if np.linalg.det(matrix) > 0.0:
                choices.append([("+" if s > 0 else "-") + "xyz"[k] for k, s in zip(order, signs, strict=True)])
    return choices[rng.integers(len(choices))]


def _orbit(preset: Preset, rng: np.random.Generator) -> list[str]:
    """Element set with a random node, perigee and place, drawn again until enough of the session is lit."""
    times = np.linspace(0.0, preset.duration, 41)
    while True:
        node, perigee, anomaly = rng.uniform(0.0, 360.0, 3)
        numbers = {"node": node, "perigee": perigee, "anomaly": anomaly, "eccentricity": rng.integers(3000) * 10}
        lines = [_with_checksum(line.format(**numbers)) for line in ELEMENTS]
        lit = World((lines[0], lines[1]), EPOCH, 0.0, preset.duration).illumination(times).mean()
        if preset.lit[0] <= lit <= preset.lit[1]:
            return lines


def _with_checksum(line: str) -> str:
    return line + str(sum(int(c) if c.isdigit() else c == "-" for c in line) % 10)
