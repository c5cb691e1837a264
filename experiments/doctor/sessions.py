"""Sessions with their truth, by the independent programs: Munin's, and those of a cube with three kinds of sensors.

The torques that Munin's own program does not know (hysteresis, eddy currents, coils, kicks ...) are those of the other.
"""

import datetime as dt
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from experiments.twins.draw import draw as draw_cube
from experiments.twins.motion import Motion
from experiments.twins.world import NODE_S
from experiments.twins.write import write_session

# The programs of that folder are run as scripts, and find each other by these names.
sys.path.insert(0, str(Path(__file__).parents[1] / "blind"))
from generate import draw as draw_munin  # noqa: E402  # pyright: ignore
from generate import raw_sun  # noqa: E402  # pyright: ignore
from motion import simulate  # noqa: E402  # pyright: ignore
from surroundings import greenwich_angle, kepler, magnetic_field  # noqa: E402  # pyright: ignore

Array = NDArray[np.float64]
Change = Callable[[dict[str, Any]], None]

MUNIN_S, MUNIN_CADENCE_S = 6000.0, 45.0
CUBE, CUBE_S, CUBE_CADENCE_S = "1u-coils", 1200.0, 10.0
REGIME = 3
"""Every third of Munin's sessions spins at up to 1.5 deg/s."""


@dataclass(frozen=True)
class Written:
    """A session on disk: what a fit reads, and the truth at times after `epoch`."""

    table: Path
    satellite: Path | None
    """None: the bundled Munin."""
    epoch: dt.datetime
    t: Array
    q: Array
    """[n 4] inertial from body, scalar first."""

    def error_deg(self, epoch: dt.datetime, t: Array, quaternion: Array) -> Array:
        """[n] angles to the truth at times after another epoch."""
        since = np.clip(t + (epoch - self.epoch).total_seconds(), self.t[0], self.t[-1])
        path = Slerp(self.t, Rotation.from_quat(self.q, scalar_first=True))
        found = Rotation.from_quat(quaternion, scalar_first=True)
        return np.degrees((path(since).inv() * found).magnitude())


class _AroundMunin:
    """Position and field as splines over time, as the other program has them."""

    def __init__(self, cfg: dict[str, Any]) -> None:
        start = dt.datetime.fromisoformat(cfg["start"])
        self.start, self.stop = 0.0, cfg["duration"] + NODE_S
        self.nodes = np.arange(-2.0 * NODE_S, self.stop + 2.0 * NODE_S, NODE_S)
        position, _ = kepler(cfg["elements"], self.nodes)
        field = magnetic_field(position, start, self.nodes, greenwich_angle(start))
        self.spline = CubicSpline(self.nodes, np.concatenate([position, field], axis=1))


def munin(seed: int, folder: Path, change: Change | None = None) -> Written:
    """Writes session `seed` of Munin with its settings changed; parts of `cfg["parts"]` are those of the twins."""
    cfg = draw_munin(REGIME * seed, hard=False)
    cfg |= {"duration": MUNIN_S, "cadence": MUNIN_CADENCE_S, "parts": {}}
    if change is not None:
        change(cfg)
    t = np.arange(0.0, cfg["duration"] + 1e-9, cfg["cadence"])
    rods = [{"axis": axis, "moment": m} for axis, m in zip(([0, 1, 0], [0, 0, 1]), cfg["rods"], strict=True)]
    parts = {key: cfg[key] for key in ("inertia", "magnet", "q0", "w0")} | cfg["parts"]
    parts["rods"] = [*rods, *cfg["parts"].get("rods", [])]
    # The world of the twins, as far as their motion looks at it.
    motion = Motion(parts, _AroundMunin(cfg))  # type: ignore[arg-type]
    fine = np.arange(0.0, cfg["duration"] + 1e-9, 1.0)
    truth = simulate(cfg, motion=motion(t))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"munin-{seed}.RAW_SUN"
    path.write_text(raw_sun(truth, np.random.default_rng([seed, 1])))
    return Written(path, None, dt.datetime.fromisoformat(cfg["start"]), fine, motion(fine)[0])


def cube(seed: int, folder: Path, change: Change | None = None) -> Written:
    """Writes session `seed` of the cube of coils, magnetometer, gyro and photodiodes, with its settings changed."""
    cfg = draw_cube(CUBE, seed)
    cfg["duration"] = CUBE_S
    for sensor in cfg["sensors"].values():
        sensor["cadence"] = CUBE_CADENCE_S
    # On a row, so that the table tells the moment of each change.
    cfg["commands"]["t"] = [CUBE_CADENCE_S * round(t / CUBE_CADENCE_S) for t in cfg["commands"]["t"]]
    if change is not None:
        change(cfg)
    table = write_session(cfg, folder)
    truth = json.loads(table.with_suffix(".truth.json").read_text())
    t, q = np.array(truth["fine"]["t"]), np.array(truth["fine"]["q"])
    return Written(table, table.with_suffix(".sat.toml"), dt.datetime.fromisoformat(truth["epoch_utc"]), t, q)
