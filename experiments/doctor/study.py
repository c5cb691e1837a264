"""Own sessions with one fault each: does the doctor name it first, and does a spoilt fit ever pass for a good one.

    .venv/bin/python -m experiments.doctor.study --seeds 5 --jobs 1 --out doctor/study.json

`--clean N` fits N sessions without a fault instead: none may be denied. `--kinds` takes some of the kinds alone. What
counts as the right name of each stands in `faults.py`. Writes the results after every session.
"""

import argparse
import datetime as dt
import json
import multiprocessing
import re
import time
import zlib
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np

CLEAN = "clean"
BEYOND = 3.0
"""Of its own sigmas, within which an attitude is right."""
EVERYTHING = ("magnet", "rods", "imax", "inertia", "albedo")
STARTS = 64


def run(kind: str, base: str, seed: int, folder: Path) -> dict[str, Any]:
    """One session with a fault (or none), fitted with the doctor on, and judged."""
    # JAX is set up before anything of it is imported.
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from experiments.doctor import sessions
    from experiments.doctor.faults import FAULTS
    from fitting.run import fit
    from fitting.settings import FitSettings
    from jaxsat.errors import InputError
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry import read_telemetry

    fault = FAULTS.get(kind)
    draw = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    right = ""

    def change(cfg: dict[str, Any]) -> None:
        nonlocal right
        if fault is not None and fault.truth is not None:
            right = fault.truth(cfg, draw)

    place = folder / f"{kind}-{seed}".replace(" ", "-").replace("/", "-")
    made = getattr(sessions, base)(seed, place, change)
    satellite = read_satellite() if made.satellite is None else read_satellite(made.satellite)
    clean = session = read_telemetry(made.table, satellite)
    if fault is not None and fault.table is not None:
        session, right = fault.table(session, draw)
    free = (fault.free if fault is not None else None) or EVERYTHING
    settings = FitSettings(free=free if base == "munin" else None, starts=STARTS)
    row: dict[str, Any] = {"kind": kind, "base": base, "seed": seed, "right": right}
    began = time.perf_counter()
    try:
        result = fit(satellite, session, settings=settings).result
    except InputError as error:
        row |= {"status": "refused", "message": str(error), "seconds": time.perf_counter() - began}
        return row | {"named": bool(fault is not None and re.search(fault.refused, str(error)))}
    row |= {"seconds": time.perf_counter() - began, "status": result.status, "verdict": result.verdict}
    row |= {"message": result.message, "remarks": list(result.remarks), "ratio": result.chi2 / max(result.dof, 1)}
    # Stamps that a fault moves: the truth is that of the instant which was meant.
    first = max(session.channels, key=lambda name: session.channels[name].t_s.size)
    moved, meant = session.channels[first].t_s, clean.channels[first].t_s[-session.channels[first].t_s.size :]
    t = np.interp(result.t_s, moved, meant) if len(moved) == len(meant) else result.t_s
    epoch = dt.datetime.fromisoformat(clean.epoch.iso(6))
    error = made.error_deg(epoch.replace(tzinfo=None), t, result.quaternion_inertial_from_body)
    sigma = np.linalg.norm(result.attitude_sigma_deg, axis=1)
    row |= {"error_deg": float(np.median(error))}
    row["sigmas"] = float(np.median(error / sigma)) if np.isfinite(sigma).all() else None
    causes = [f"{each.kind}: {each.cause} [{each.option}]" for each in result.causes]
    row["causes"] = [
        {"text": text, "chi2": [each.chi2_before, each.chi2_after], "explains": each.explains}
        for text, each in zip(causes, result.causes, strict=True)
    ]
    at_truth = result.status == "converged" and row["sigmas"] is not None and row["sigmas"] < BEYOND
    row["named"] = bool(causes and right and re.search(right, causes[0]))
    row["handled"] = bool(fault is not None and fault.absorbed and at_truth)
    row["wrong"] = result.status == "converged" and not at_truth
    return row


def rows_of(tasks: list[tuple[str, str, int]], folder: Path, jobs: int) -> Iterator[dict[str, Any]]:
    """Results as they come."""
    if jobs < 2:
        for task in tasks:
            yield run(*task, folder)
        return
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        for done in as_completed([pool.submit(run, *task, folder) for task in tasks]):
            yield done.result()


def line(row: dict[str, Any]) -> str:
    """One session in a line."""
    word = "named" if row.get("named") else "handled" if row.get("handled") else "WRONG" if row.get("wrong") else "-"
    text = f"{row['kind']:22s} {row['seed']:3d} {word:8s} {row['status']:13s} {row['seconds']:5.1f} s"
    if row["status"] == "refused":
        return f"{text} {row['message'][:90]}"
    told = row["causes"][0]["text"][:90] if row["causes"] else row["message"][:90]
    return f"{text} {row['error_deg']:7.2f} deg | {told}"


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts by kind and of all."""
    kinds = {}
    for row in rows:
        each = kinds.setdefault(row["kind"], {"sessions": 0, "right": 0, "wrong": 0, "denied": 0})
        each["sessions"] += 1
        each["right"] += bool(row.get("named") or row.get("handled"))
        each["wrong"] += bool(row.get("wrong"))
        each["denied"] += row["status"] != "converged"
    whole = {key: sum(each[key] for each in kinds.values()) for key in ("sessions", "right", "wrong", "denied")}
    return {"all": whole, "seconds_median": float(np.median([row["seconds"] for row in rows])), "kinds": kinds}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, help="sessions of each kind")
    parser.add_argument("--first", type=int, default=1, help="number of the first")
    parser.add_argument("--kinds", nargs="+", help="of faults [all]")
    parser.add_argument("--clean", type=int, default=0, help="sessions without a fault, in place of the others")
    parser.add_argument("--base", default="munin", choices=("munin", "cube"), help="of the clean ones")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=Path("doctor/study.json"), help="results")
    asked = parser.parse_args()

    from experiments.doctor.faults import FAULTS

    if asked.clean:
        tasks = [(CLEAN, asked.base, seed) for seed in range(asked.first, asked.first + asked.clean)]
    else:
        seeds = range(asked.first, asked.first + asked.seeds)
        tasks = [(kind, FAULTS[kind].base, seed) for seed in seeds for kind in asked.kinds or FAULTS]
        # Sessions of one base share their programs.
        tasks.sort(key=lambda task: task[1], reverse=True)
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    for row in rows_of(tasks, asked.out.parent / "sessions", asked.jobs):
        rows.append(row)
        print(line(row), flush=True)
        # After each, so that a long study can be stopped.
        result = {"schema": "jaxsat.doctor/1", "summary": summary(rows), "runs": rows}
        asked.out.write_text(json.dumps(result, indent=1) + "\n")
    for kind, each in summary(rows)["kinds"].items():
        print(f"{kind:22s} {each['right']} of {each['sessions']} right, {each['wrong']} wrong")
    print(summary(rows)["all"])


if __name__ == "__main__":
    main()
