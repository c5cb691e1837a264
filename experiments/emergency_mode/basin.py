"""From where the transition of the emergency mode finds the orbital attitude: by how far off 1000 starts begin.

The sweep `emergency-mode` with inertia known to 5 %, a field model to 2 %, a magnetometer to 1 %, and noise; once to
30 deg and once to half a turn. A start has succeeded if its error is below 1 deg in the last half of the fourth orbit.
Prints the share by the error at the start, and how far the error rises on the way; writes JSON and a picture.

    .venv/bin/python experiments/emergency_mode/basin.py --cases 1000 --out out/emergency-basin
"""

import argparse
import json
from pathlib import Path

import numpy as np

SPREAD = {"inertia": "0.05", "field": "0.02", "magnetometer": "0.01"}
REACHES_DEG = (30, 180)
BANDS = 6
SEED = 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000, help="of each of the two, rounded up to chunks of 250")
    parser.add_argument("--out", type=Path, default=Path("out/emergency-basin"), help="directory for results")
    arguments = parser.parse_args()
    if not 1 <= arguments.cases <= 10**6:
        parser.error(f"--cases must be from 1 to 1000000, got {arguments.cases}")
    arguments.out.mkdir(parents=True, exist_ok=True)

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.sweep.scenarios import emergency_mode

    report: dict = {"schema": "jaxsat.emergency-basin/1", "spread": SPREAD, "seed": SEED}
    found = {}
    for reach in REACHES_DEG:
        scenario = emergency_mode.make({**SPREAD, "max_error_deg": str(reach)})
        chunks = -(-arguments.cases // scenario.chunk)
        numbers = np.arange(chunks * scenario.chunk).reshape(chunks, -1)
        parts = [scenario.run(SEED, part) for part in numbers]
        found[reach] = cases = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        good, first, largest = cases["status"] == 0, cases["first_error_deg"], cases["largest_error_deg"]
        edges = np.linspace(0.0, reach, BANDS + 1)
        bands = []
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            inside = (first >= low) & (first < high)
            band = {"from_deg": low, "to_deg": high, "cases": int(inside.sum()), "share": float(good[inside].mean())}
            p50, p95 = np.nanpercentile(largest[inside], [50.0, 95.0]).tolist()
            bands.append(band | {"largest_deg": {"p50": p50, "p95": p95, "max": float(np.nanmax(largest[inside]))}})
        report[f"to_{reach}_deg"] = {"cases": len(good), "succeeded": int(good.sum()), "bands": bands}
        print(f"to {reach} deg: {good.sum()} of {len(good)} below 1 deg in the last half of the fourth orbit")
        print("   " + ", ".join(f"{b['from_deg']:.0f}-{b['to_deg']:.0f}: {100 * b['share']:.1f} %" for b in bands))
        spans = (f"{b['largest_deg']['p50']:.0f}, {b['largest_deg']['max']:.0f}" for b in bands)
        print(f"   largest error on the way, median and most, deg: {'; '.join(spans)}")
    picture(found, arguments.out / "basin.png")
    (arguments.out / "basin.json").write_text(json.dumps(report, indent=1))


def picture(found: dict[int, dict[str, np.ndarray]], path: Path) -> None:
    from jaxsat.plotting.style import LEFT_OUT, dress, head, new_figure, png_bytes

    figure = new_figure(
        9.6, 6.4, "Basin of the transition", "each dot a start with inertia, field and noise of its own"
    )
    grid = figure.subplots(
        2, len(found), gridspec_kw={"left": 0.08, "right": 0.98, "top": 0.85, "bottom": 0.09, "hspace": 0.28}
    )
    for column, (reach, cases) in enumerate(found.items()):
        good, first = cases["status"] == 0, cases["first_error_deg"]
        hours, last = cases["settling_time_s"] / 3600.0, cases["last_error_deg"]
        top, bottom = grid[0, column], grid[1, column]
        top.plot(first[good], hours[good], ".", ms=3, color="#2340a8")
        for mask, colour, name in ((good, "#2340a8", "succeeded"), (~good, LEFT_OUT, "not settled")):
            if mask.any():
                bottom.plot(first[mask], last[mask], ".", ms=3, color=colour, label=f"{name}: {mask.sum()}")
        bottom.axhline(1.0, color="#222222", lw=0.8, ls="--")
        bottom.set_yscale("log")
        bottom.legend(frameon=False, fontsize=8, loc="upper left", ncols=2, borderpad=0)
        bottom.set_ylim(0.5 * last.min(), 6.0 * last.max())
        head(top, f"starts to {reach} deg: until below 1 deg for good")
        head(bottom, "largest error of the last half orbit")
        dress(top, y_label="hours")
        dress(bottom, y_label="deg", x_label="error at the start, deg")
        for axes in (top, bottom):
            axes.set_xlim(0.0, reach)
        top.set_ylim(bottom=0.0)
    path.write_bytes(png_bytes(figure))


if __name__ == "__main__":
    main()
