"""Blind fits of many twins of a kind: how often the truth is found, whether misses are owned up to, and honest sigmas.

    .venv/bin/python -m experiments.twins.study 1u-unitmag --seeds 100 --jobs 2 --out twins

Each fit gets the table and the satellite file and no other help. Writes OUT/KIND.json after every session and
OUT/KIND.png; sessions stay in OUT/sessions.
"""

import argparse
import json
import multiprocessing
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from experiments.twins.draw import SPREAD, draw
from experiments.twins.picture import picture
from experiments.twins.presets import PRESETS
from experiments.twins.score import score, summary
from experiments.twins.write import write_session

HOLDOUT = {"3u-panels": 0.15}
"""Share held out where it is not 0.3: the panels' motion is nearly chaotic."""


def document_of(table: Path, satellite_file: Path, holdout: float) -> dict[str, Any]:
    """Fits a table as `jaxsat fit TABLE --satellite FILE --holdout H` does; answers what counts of fit.json."""
    # Fitting is the only user of the simulator here, and JAX is to be set up before anything of it is imported.
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from fitting.run import fit
    from fitting.settings import FitSettings
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry.table.reading import read_tables

    satellite = read_satellite(satellite_file)
    session = read_tables(table, satellite)
    result = fit(satellite, session, settings=FitSettings(holdout=holdout), causes=False).result
    return {
        "epoch_utc": session.epoch.iso(3),
        "status": result.status,
        "message": result.message,
        "verdict": result.verdict,
        "chi2": result.chi2,
        "dof": result.dof,
        "parameters": {
            p.name: {"value": p.value, "sigma": p.sigma, "unit": p.unit, "free": p.free, "note": p.note}
            for p in result.parameters
        },
        "attitude": {
            "t_s": result.t_s.tolist(),
            "quaternion_inertial_from_body": result.quaternion_inertial_from_body.tolist(),
            "attitude_sigma_deg": result.attitude_sigma_deg.tolist(),
        },
        "axes": dict(result.axes),
        "alternatives": list(result.alternatives),
        "holdout": {
            name: {"rms": channel.holdout.rms, "sigma_ratio": channel.holdout.sigma_ratio}
            for name, channel in result.channels.items()
            if channel.holdout
        },
        "timing_s": dict(result.timing_s),
    }


def run(kind: str, seed: int, spread: float, folder: Path) -> dict[str, Any]:
    """One twin, made, fitted and judged; a refusal is a row too."""
    table = write_session(draw(kind, seed, spread), folder)
    truth = json.loads(table.with_suffix(".truth.json").read_text())
    holdout = HOLDOUT.get(kind, 0.3)
    began = time.perf_counter()
    try:
        document = document_of(table, table.with_suffix(".sat.toml"), holdout)
    except Exception as error:  # A study counts what no other code foresaw, too.
        message = f"{type(error).__name__}: {error}"
        return {"session": truth["name"], "seed": seed, "status": "refused", "message": message, "silent": False}
    row = score(document, truth, holdout=holdout) | {"seed": seed, "seconds": time.perf_counter() - began}
    kept = {"message", "chi2", "dof", "holdout", "timing_s", "alternatives"}
    return row | {key: value for key, value in document.items() if key in kept}


def line(row: dict[str, Any]) -> str:
    """One session in a line."""
    if "attitude_deg" not in row:
        return f"{row['session']:16s} {row['status']}: {row['message']}"
    text = f"{row['session']:16s} {row['status']:13s} {row['attitude_deg']:8.3f} deg (sigma {row['sigma_deg']:.3f})"
    text += f"  worst z {max((abs(z) for z in row['z'].values()), default=0.0):5.1f}"
    text += f"  chi2/dof {row['chi2'] / max(row['dof'], 1):6.2f}  {row['seconds']:5.1f} s"
    text += f"  axes {row['axes']}" if row["axes"] else ""
    return text + ("" if row["reached"] else "  MISSED") + ("  SILENT" if row["silent"] else "")


def rows_of(kind: str, seeds: list[int], spread: float, folder: Path, jobs: int) -> Iterator[dict[str, Any]]:
    """Rows of a study as they come; a process keeps what it has compiled for its next session."""
    if jobs == 1:
        yield from (run(kind, seed, spread, folder) for seed in seeds)
        return
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        for done in as_completed([pool.submit(run, kind, seed, spread, folder) for seed in seeds]):
            yield done.result()


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=PRESETS)
    parser.add_argument("--seeds", type=int, default=100, help="how many sessions")
    parser.add_argument("--first", type=int, default=1, help="seed of the first")
    parser.add_argument("--spread", type=float, default=SPREAD, help="scatter of the truth over the file's sigmas")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=Path("twins"))
    asked = parser.parse_args()
    seeds = list(range(asked.first, asked.first + asked.seeds))
    asked.out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    for row in rows_of(asked.kind, seeds, asked.spread, asked.out / "sessions", asked.jobs):
        rows.append(row)
        print(line(row), flush=True)
        rows.sort(key=lambda each: each["seed"])
        result = {"schema": "jaxsat.twins/1", "kind": asked.kind, "spread": asked.spread, "summary": summary(rows)}
        # After each, so that a long study can be stopped.
        (asked.out / f"{asked.kind}.json").write_text(json.dumps(result | {"runs": rows}, indent=1) + "\n")
    found = summary(rows)
    picture(asked.kind, rows, asked.out / f"{asked.kind}.png")
    print()
    for name, value in found.items():
        if name != "z_rms_of":
            print(f"{name:20s} {value if not isinstance(value, float) else f'{value:.4g}'}")
    print("z RMS by parameter: " + "  ".join(f"{name} {value:.2f}" for name, value in found["z_rms_of"].items()))


if __name__ == "__main__":
    main()
