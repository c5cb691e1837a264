"""Sweeps in both precisions on a GPU and on the CPU: how fast, and how far from double precision on the CPU?

For whoever has a GPU that JAX finds; without one it says so and measures the CPU alone. Each precision and device has a
process of its own, which runs each scenario as `jaxsat sweep` does, twice: the first run compiles, the second is timed.
Of the cases that all have, those of the scenario's own chunk, single precision and the GPU are compared with double
precision on the CPU, case by case. What is not begun after `--minutes` is left out, and said. Prints a table, writes
JSON.

    .venv/bin/pip install -e . 'jax[cuda13]'
    .venv/bin/python experiments/benchmarks/gpu_sweeps.py --out gpu-sweeps.json
"""

import argparse
import json
import multiprocessing
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.sweep import Metric, Source, SweepPlan, claim, merge_cases, run_local
from jaxsat.sweep.merge import read_metric
from jaxsat.sweep.precision.agreement import agreement

SCENARIOS = ("detumble", "sun-pointing", "point", "emergency-mode", "earth-search", "gravity-gradient")
"""In the order in which they are begun."""
ON_CPU = (2000, 10_000, 800, 4000, 10_000, 10_240)
CASES = {"cpu": dict(zip(SCENARIOS, ON_CPU, strict=True)), "gpu": dict.fromkeys(SCENARIOS, 32_768)}
GPU_CHUNK = 16_384
SEED = 1
KEYS = ("median_over_spread", "percentiles_over_spread")
Found = dict[str, np.ndarray]
NEEDED = ("float64", "cpu")
"""What all others are compared with, so it is the first."""


def measure(sender: Connection, precision: str, device: str, names: list[str], few: int | None) -> None:
    """For a process of its own: sends a row, or what went wrong, for each scenario."""
    for name in names:
        try:
            sender.send(_row(name, precision, device, few))
        except Exception as error:  # Another scenario may still run where this one has not enough memory.
            sender.send(f"{type(error).__name__}: {str(error).splitlines()[0]}")


def _row(name: str, precision: str, device: str, few: int | None) -> tuple[dict[str, Any], Found, Mapping[str, Metric]]:
    """Times of a scenario, and status and metrics of the cases of its own chunk, with what the metrics are."""
    module = f"jaxsat.sweep.scenarios.{name.replace('-', '_')}:make"
    source = Source.of(module, {}, prepare="jaxsat.numerics:set_up_jax", arguments=(precision, device))
    scenario = source.scenario()
    own, cases = scenario.chunk, few or CASES[device][name]
    chunk = own * max(1, min(cases, GPU_CHUNK) // own) if device == "gpu" else own
    source = Source(source.address, source.options, source.prepare, source.code, source.arguments, chunk)
    scenario = source.scenario()
    # Whole chunks, of which one after the other is timed.
    plan = SweepPlan(scenario.name, SEED, dict(source.options), chunk, chunk * max(2, cases // chunk))
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        for turn in ("first", "again"):
            directory = Path(folder) / turn
            claim(directory, plan)
            began = time.perf_counter()
            run_local(source, plan, directory, plan.shard(), on_done=lambda done: None)
            seconds.append(time.perf_counter() - began)
        status = merge_cases(scenario, plan, directory)
        found = {"status": status[:own], **{each: read_metric(directory, each)[:own] for each in scenario.metrics}}
    row = {
        "scenario": name,
        "device": device,
        "precision": precision,
        "chunk": chunk,
        "cases": plan.cases,
        "first_s": seconds[0],
        "sweep_s": seconds[1],
        "cases_per_s": plan.cases / seconds[1],
    }
    return row, found, scenario.metrics


def has_gpu() -> bool:
    """Whether JAX finds one; asked in another process, for JAX keeps the memory of a GPU that it has seen."""
    script = "import jax; print(jax.default_backend())"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    return done.stdout.strip() == "gpu"


def compared(metrics: Mapping[str, Metric], double: Found, found: Found) -> dict[str, Any]:
    """How far cases are from those of double precision on the CPU."""
    told = agreement(metrics, double, found)
    shares = {key: max(m[key] for m in told["metrics"].values()) for key in KEYS}
    return {"compared": told["cases"], "ends_otherwise": told["ends_otherwise"], **shares, "metrics": told["metrics"]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("gpu-sweeps.json"))
    parser.add_argument("--scenarios", nargs="+", choices=SCENARIOS, default=list(SCENARIOS))
    parser.add_argument("--cases", type=int, help="of each scenario, on both devices: a few, to try this script")
    parser.add_argument("--minutes", type=float, default=8.0)
    arguments = parser.parse_args()
    end = time.perf_counter() + 60.0 * arguments.minutes
    kinds = [NEEDED, ("float32", "cpu")]
    if has_gpu():
        kinds += [("float32", "gpu"), ("float64", "gpu")]
    else:
        print("NO GPU: JAX finds the CPU alone, so that this is no table of a GPU but of both precisions on the CPU.")
    columns = f"{'':17}{'':5}{'':9}{'chunk':>7}{'cases':>7}{'first, s':>10}{'sweep, s':>10}{'cases/s':>9}{'times':>7}"
    print(f"{columns}{'otherwise':>11}{'off':>9}{'moved':>9}")
    rows: list[dict[str, Any]] = []
    double: dict[str, Found] = {}
    base: dict[str, float] = {}
    context = multiprocessing.get_context("spawn")
    for precision, device in kinds:
        receiver, sender = context.Pipe(duplex=False)
        given = (sender, precision, device, arguments.scenarios, arguments.cases)
        process = context.Process(target=measure, args=given, daemon=True)
        process.start()
        sender.close()
        for name in arguments.scenarios:
            label = f"{name:17}{device:5}{precision:9}"
            if not receiver.poll(max(0.0, end - time.perf_counter())):
                print(f"{label}left out: {arguments.minutes:g} minutes are over", flush=True)
                continue
            try:
                sent = receiver.recv()
            except EOFError:
                print(f"{label}its process has died; is there memory enough?", flush=True)
                break
            if isinstance(sent, str):
                print(f"{label}{sent}", flush=True)
                continue
            row, found, metrics = sent
            if (precision, device) == NEEDED:
                double[name], base[name] = found, row["cases_per_s"]
            off = ""
            if name in double:
                row["over_cpu_float64"] = row["cases_per_s"] / base[name]
                row |= compared(metrics, double[name], found)
                off = f"{row['over_cpu_float64']:7.2f}{row['ends_otherwise']:5d} of {row['compared']:4d}"
                off += "".join(f"{row[key]:9.1e}" for key in KEYS)
            rows.append(row)
            times = f"{row['first_s']:10.1f}{row['sweep_s']:10.2f}{row['cases_per_s']:9.0f}"
            print(f"{label}{row['chunk']:7}{row['cases']:7}{times}{off}", flush=True)
        process.terminate()
        process.join()
    print(
        "times: cases/s over those of float64 on the CPU. otherwise: cases that end with another status. off: the\n"
        "largest median difference of a metric over its spread (5th to 95th percentile); moved: that of a percentile."
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps({"gpu": len(kinds) > 2, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
