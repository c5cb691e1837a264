"""How cost and memory grow with cases, arc length, what is free, and samples: a table, a picture with slopes, JSON.

Each point is a process of its own (`models/growth_points.py`): its best time of three (of one where it takes longer
than 20 s), and the peak of memory over what stood before, compilation and first run included. Small sizes come first;
what is not begun after `--minutes`, or is above `--largest`, is left out and said. The slope is that of a figure over
size on logarithmic scales, through the points from the middle on: 1 is proportional. The picture has the processor's
time, which other work on the machine moves least.

    .venv/bin/python experiments/benchmarks/growth.py --out growth
"""

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).resolve().parent
POINT = HERE / "models" / "growth_points.py"


@dataclass(frozen=True)
class Line:
    """What grows, in which sizes."""

    panel: str
    """Horizontal axis, with its unit."""
    label: str
    sizes: tuple[int, ...]


LINES = {
    "cases": Line("cases", "simulate_many, 900 s", (100, 1000, 10_000, 100_000, 1_000_000)),
    "arc": Line("arc, h", "1 satellite, last state", (1, 6, 24, 168, 720)),
    "read": Line("arc, h", "16 satellites, 100 samples", (1, 6, 24, 168, 720)),
    "free": Line("free parameters", "Jacobian, 75 samples of 4500 s", (6, 8, 16, 32, 64)),
    "samples": Line("samples", "local fit, 18 unknowns, 1 Hz", (100, 1000, 10_000, 86_400)),
}


def point(name: str, size: int, limit: float) -> dict[str, Any] | str:
    """Times and memory of one point, or why there are none."""
    path = os.pathsep.join((str(HERE), str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")))
    command = [sys.executable, str(POINT), name, str(size)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=limit, env={**os.environ, "PYTHONPATH": path}
        )
    except subprocess.TimeoutExpired:
        return f"not ended after {limit:.0f} s"
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if "Error" in line]
        return (said or done.stderr.splitlines() or [f"status {done.returncode}"])[-1][:150]
    return json.loads(done.stdout.splitlines()[-1])


def slope(rows: list[dict[str, Any]], key: str) -> float | None:
    """Of `key` over size on logarithmic scales, through the points from the middle on."""
    late = rows[len(rows) // 2 - (len(rows) == 2) :]
    if len(late) < 2:
        return None
    size, value = (np.log([row[name] for row in late]) for name in ("size", key))
    return round(float(np.polyfit(size, value, 1)[0]), 3) + 0.0


def _short(size: int) -> str:
    """A size as a tick has room for it."""
    return f"{size / 1e6:g}M" if size >= 1e6 else f"{size / 1e3:g}k" if size >= 1e3 else str(size)


def picture(found: dict[str, list[dict[str, Any]]], out: Path) -> None:
    """A panel for what grows, time above and memory below."""
    panels = list(dict.fromkeys(line.panel for line in LINES.values()))
    figure, axes = plt.subplots(2, len(panels), figsize=(13.0, 6.4), layout="constrained")
    for name, line in LINES.items():
        rows, column = found[name], panels.index(line.panel)
        if not rows:
            continue
        size = [row["size"] for row in rows]
        for place, key in ((0, "cpu_s"), (1, "peak_MB")):
            axis, exponent = axes[place, column], slope(rows, key)
            told = line.label if exponent is None else f"{line.label}:\nslope {exponent:z.2f}"
            axis.loglog(size, [row[key] for row in rows], "o-", ms=4, label=told)
            axis.set_xticks(size, [_short(each) for each in size], fontsize=8)
            axis.minorticks_off()
    for column, panel in enumerate(panels):
        axes[1, column].set_xlabel(panel)
        axes[0, column].set_ylim(1e-3, 1e3)
        axes[1, column].set_ylim(30.0, 10_000.0)
        for axis in axes[:, column]:
            axis.legend(fontsize=8, frameon=False, loc="upper left")
            axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("processor time of a call, s")
    axes[1, 0].set_ylabel("peak memory, MB")
    figure.savefig(out, dpi=110)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("growth"), help="directory for growth.json and growth.png")
    parser.add_argument("--largest", nargs="*", default=[], metavar="NAME=SIZE", help=f"of {', '.join(LINES)}")
    parser.add_argument("--minutes", type=float, default=8.0)
    arguments = parser.parse_args()
    largest = {}
    for given in arguments.largest:
        name, _, size = given.partition("=")
        if name not in LINES or not size.isdigit():
            parser.error(f"--largest: expected NAME=SIZE with a NAME of {', '.join(LINES)}, got {given!r}")
        largest[name] = int(size)
    end = time.perf_counter() + 60.0 * arguments.minutes
    arguments.out.mkdir(parents=True, exist_ok=True)
    found: dict[str, list[dict[str, Any]]] = {name: [] for name in LINES}
    left_out: list[str] = []
    print(f"{'':9}{'size':>9}{'first, s':>10}{'time, s':>10}{'CPU, s':>10}{'peak, MB':>10}")
    # All small sizes before the first large one.
    for place in range(max(len(line.sizes) for line in LINES.values())):
        for name, line in LINES.items():
            if place >= len(line.sizes):
                continue
            size, left = line.sizes[place], end - time.perf_counter()
            label = f"{name:9}{size:9d}"
            if size > largest.get(name, size):
                row: dict[str, Any] | str = "above --largest"
            else:
                row = f"not begun: {arguments.minutes:g} minutes are over" if left <= 5.0 else point(name, size, left)
            if isinstance(row, str):
                left_out.append(f"{name} {size}: {row}")
                print(f"{label}  {row}", flush=True)
                continue
            found[name].append({"size": size, **row})
            print(
                f"{label}{row['first_s']:10.1f}{row['s']:10.4f}{row['cpu_s']:10.4f}{row['peak_MB']:10.0f}", flush=True
            )
    slopes = {name: {key: slope(rows, key) for key in ("s", "cpu_s", "peak_MB")} for name, rows in found.items()}
    for name, each in slopes.items():
        told = ["-" if value is None else f"{value:.2f}" for value in each.values()]
        print(f"{name:9} slope of time {told[0]}, of processor time {told[1]}, of memory {told[2]}")
    document = {"cores": os.cpu_count(), "points": found, "slopes": slopes, "left_out": left_out}
    (arguments.out / "growth.json").write_text(json.dumps(document, indent=1))
    picture(found, arguments.out / "growth.png")


if __name__ == "__main__":
    main()
