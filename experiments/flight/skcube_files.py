"""skCUBE's frames as tables that a satellite file can be asked about: one folder a pass.

The published frames are taken as they are but for two things that no condition on a row can say. An angle of a Sun
sensor counts only where that sensor stands in full light: at the rim of its field it turns its sign, and in the dark it
tells anything. And the currents of a pass go to a table of their own.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ADCS, POWER = "skcube_adcs.csv", "skcube_pwr.csv"
FULL = {"Xp": 53, "Xm": 64, "Yp": 56, "Ym": 53, "Zp": 57}
"""Brightest readings of each Sun sensor; that on -z is dead."""
BRIGHT, WIDEST_DEG = 0.75, 50
"""Share of the brightest reading, and angle, up to which the angles of a Sun sensor count."""
CURRENTS = ("iXp", "iXm", "iYp", "iYm", "iZp", "iZm")
COSINE_S = 200.0
"""So long after the first frame behind the shadow the battery takes all that the panels give."""
EMPTY_MV = 3500.0
"""Below it the battery takes all for certain; in the second evening pass 3567 mV halve the currents."""
KEPT = (
    *(f"sun{face}_{what}" for face in FULL for what in ("x", "y", "irr")),
    *("gx", "gy", "gz", "m2x", "m2y", "m2z"),
)


@dataclass(frozen=True)
class Pass:
    """Frames that were received while the satellite was above the horizon."""

    name: str
    begin: int
    """Unix time of the first frame [s]."""
    end: int
    after_shadow: bool
    """Whether its first frames have a battery that takes all."""

    def in_full_sun(self, t_s: np.ndarray) -> np.ndarray:
        """[frames] whether the currents at these times obey the cosine law, as far as is known beforehand."""
        return self.after_shadow & (t_s - t_s[0] <= COSINE_S)


PASSES = (
    Pass("evening-1", 1498677500, 1498678120, True),
    Pass("evening-2", 1498683200, 1498683680, True),
    Pass("morning", 1498644600, 1498645100, False),
)
"""Of 28 June 2017 (UTC 19:18, 20:53 and 10:10): those with frames of both kinds and no control."""


def write_tables(data: Path, folder: Path, each: Pass) -> tuple[Path, Path]:
    """Writes `adcs.csv` and `power.csv` of a pass into `folder`; returns their paths.

    Raises OSError for a file that is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    adcs, power = folder / "adcs.csv", folder / "power.csv"
    frames = [_angles_in_light(row) for row in _of(data / ADCS, each)]
    _write(adcs, ["t_rx", "mode", *KEPT], frames)
    _write(power, ["t_rx", *CURRENTS, "uBatA"], _of(data / POWER, each))
    return adcs, power


def battery_mv(power: Path) -> np.ndarray:
    """[frames] of a written table of a pass."""
    with power.open(encoding="utf-8", newline="") as stream:
        return np.array([float(row["uBatA"]) for row in csv.DictReader(stream)])


def _of(path: Path, each: Pass) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return [row for row in csv.DictReader(stream) if each.begin <= int(row["t_rx"]) <= each.end]


def _angles_in_light(row: dict[str, str]) -> dict[str, str]:
    found = dict(row)
    for face, full in FULL.items():
        angles = [f"sun{face}_x", f"sun{face}_y"]
        wide = max(abs(int(row[name])) for name in angles)
        if int(row[f"sun{face}_irr"]) < BRIGHT * full or wide >= WIDEST_DEG:
            found.update(dict.fromkeys(angles, ""))
    return found


def _write(path: Path, names: list[str], rows: list[dict[str, str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, names, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
