"""OPS-SAT's two files as tables of one clock: the export of a monitoring system has comments in place of a header.

The table of the attitude gets two columns beside the quaternion, by which rows are left out (`[rows] keep`): whether it
`repeats` a neighbour, as while the attitude control does not run and the last estimate stands, and the rate of the
faster of the turns to its neighbours, which leaps where the estimate does.

    python -m experiments.flight.opssat_files DIR       # writes the excerpt in experiments/flight/data
"""

import csv
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

ATTITUDE, DIODES = "O_Q_FB_FI_EST.csv", "I_PD_THETA_PD3_PD6.csv"
EXCERPT = Path(__file__).parent / "data"
EPOCH = datetime(2020, 11, 15, tzinfo=UTC)
NEIGHBOUR_S = 35.0
"""Quaternions farther apart than this are no neighbours."""


def seconds(text: str) -> float:
    """After the epoch, of a stamp without a time zone, which is UTC."""
    return (datetime.fromisoformat(text).replace(tzinfo=UTC) - EPOCH).total_seconds()


def read_attitude(path: Path) -> np.ndarray:
    """[n 7] time [s], quaternion as sent, 1 where it repeats a neighbour, rate [deg/s] or NaN."""
    rows = [
        line.split(",") for line in path.read_text("utf-8").splitlines() if line[:2] == "20" and line.count(",") == 4
    ]
    t = np.array([seconds(row[0]) for row in rows])
    q = np.array([[float(cell) for cell in row[1:]] for row in rows])
    known = np.abs(q).sum(axis=1) > 0.5
    turns = Rotation.from_quat(np.where(known[:, None], q, [1.0, 0.0, 0.0, 0.0]), scalar_first=True)
    step = np.diff(t)
    near = (step < NEIGHBOUR_S) & known[1:] & known[:-1]
    rate = np.where(near, np.degrees((turns[:-1] * turns[1:].inv()).magnitude()) / step, np.nan)
    same = near & np.all(q[1:] == q[:-1], axis=1)
    repeats = np.concatenate([same, [False]]) | np.concatenate([[False], same])
    fastest = np.fmax(np.concatenate([rate, [np.nan]]), np.concatenate([[np.nan], rate]))
    return np.column_stack([t, q, repeats, fastest])


def read_diodes(path: Path) -> np.ndarray:
    """[n 3] time [s], elevations of the photodiodes 3 and 6 [rad]."""
    with path.open(encoding="utf-8", newline="") as stream:
        return np.array(
            [[seconds(row["TIMESTAMP"]), float(row["PD3"]), float(row["PD6"])] for row in csv.DictReader(stream)]
        )


def write_tables(attitude: np.ndarray, diodes: np.ndarray, folder: Path, digits: int) -> tuple[Path, Path]:
    """Writes both tables and returns their paths; `digits` are those of the quaternions."""
    paths = folder / "opssat-attitude.csv", folder / "opssat-diodes.csv"
    with paths[0].open("w", encoding="utf-8", newline="\n") as stream:
        stream.write("t_s,qw,qx,qy,qz,repeats,turns_deg_s\n")
        for t, *q, repeats, rate in attitude.tolist():
            numbers = ",".join(f"{x:.{digits}f}" for x in q)
            stream.write(f"{t:.1f},{numbers},{repeats:.0f},{'' if np.isnan(rate) else f'{rate:.1f}'}\n")
    with paths[1].open("w", encoding="utf-8", newline="\n") as stream:
        stream.write("t_s,pd3,pd6\n")
        stream.writelines(f"{t:.0f},{a:.4f},{b:.4f}\n" for t, a, b in diodes.tolist())
    return paths


def tables_of(source: Path, folder: Path) -> tuple[Path, Path]:
    """Writes the tables of the published files in `source` into `folder`."""
    return write_tables(read_attitude(source / ATTITUDE), read_diodes(source / DIODES), folder, 6)


def excerpt(source: Path) -> None:
    """Every second row of the diodes, as often as there is an attitude, and the attitudes around them."""
    attitude, diodes = read_attitude(source / ATTITUDE), read_diodes(source / DIODES)[::2]
    place = np.searchsorted(diodes[:, 0], attitude[:, 0])
    near = [np.abs(diodes[np.clip(place + k, 0, len(diodes) - 1), 0] - attitude[:, 0]) for k in (-1, 0)]
    held = attitude[:, 5] == 1.0
    # Of estimates that stand still the first and the last tell as much.
    inside = held & np.roll(held, 1) & np.roll(held, -1)
    write_tables(attitude[(np.minimum(*near) < 10.6) & ~inside], diodes, EXCERPT, 4)


if __name__ == "__main__":
    excerpt(Path(sys.argv[1]))
