"""Sweeps by their workers: one core, threads, shards in processes of their own, dask; are all tables the same bytes?

Each way is the command `jaxsat sweep` as a user gives it, in processes of its own, with programs that were compiled
before. `time` is from the start of the first process to the end of the last, so imports and the reading of compiled
programs count in it; `cases/s` is the rate once all are under way, from the end of the first chunk to that of the last.
Two minutes on two cores. Prints a table, writes JSON; ends with status 1 if two tables differ.

    .venv/bin/pip install -e '.[dask]'
    .venv/bin/python experiments/benchmarks/throughput.py --out throughput.json
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

JOBS = {"detumble": 2000, "sun-pointing": 20_000}
"""Cases of each scenario."""
SEED, FIRST = 1, 2000
"""Cases of the sweep that compiles: more than a chunk."""
COMMAND = (sys.executable, "-c", "import jaxsat.cli.main as m\nif __name__ == '__main__': m.main()")
CORES = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))


ALONE = {**os.environ, "NPROC": "1"}
"""One thread of XLA's a process, so that processes do not get into each other's way."""


@dataclass(frozen=True)
class Way:
    """How a sweep is run: the words of each of its processes, and the cores that each may use."""

    processes: tuple[tuple[str, ...], ...]
    cores: tuple[list[int], ...] = ()


def ways(workers: int, scheduler: str) -> dict[str, Way]:
    """All ways by their names, with so many workers but in the first."""
    parts = tuple(("--shard", f"{part}/{workers}") for part in range(1, workers + 1))
    return {
        "one process, one core": Way((("--workers", "1"),), (CORES[:1],)),
        f"one process, {workers} threads": Way((("--workers", str(workers)),)),
        f"{workers} shards, a core each": Way(
            tuple((*part, "--workers", "1") for part in parts), tuple([core] for core in CORES[:workers])
        ),
        f"dask, {workers} processes of its own": Way((("--engine", "dask", "--workers", str(workers)),)),
        f"dask, a scheduler with {workers} workers": Way((("--engine", "dask", "--scheduler", scheduler),)),
    }


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """Address of a scheduler and its workers, started as on a cluster."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "scheduler.json"
        dask = (sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--dashboard-address", ":0")
        begun = [subprocess.Popen([*dask, "--scheduler-file", str(told)], stderr=subprocess.DEVNULL)]
        worker = (sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-dashboard")
        try:
            while not told.exists() or not told.read_text():
                time.sleep(0.05)
            for _ in range(workers):
                more = ("--scheduler-file", str(told), "--local-directory", folder)
                begun.append(subprocess.Popen([*worker, *more], stderr=subprocess.DEVNULL, env=ALONE))
            yield json.loads(told.read_text())["address"]
        finally:
            for process in reversed(begun):
                process.terminate()
                process.wait()


def run(name: str, cases: int, way: Way, out: Path) -> dict[str, float]:
    """Runs a sweep in one way and returns its times [s] and rate."""
    shared = ("sweep", name, "--cases", str(cases), "--seed", str(SEED), "--no-plots", "-q", "--out", str(out))
    began, running = time.perf_counter(), []
    for number, words in enumerate(way.processes):
        limit: Callable[[], None] | None = None
        if way.cores and hasattr(os, "sched_setaffinity"):
            limit = lambda cores=way.cores[number]: os.sched_setaffinity(0, cores)  # noqa: E731
        running.append(subprocess.Popen([*COMMAND, *shared, *words], preexec_fn=limit))
    if any(process.wait() for process in running):
        sys.exit(f"{name}: a process of {way.processes} failed")
    wall = time.perf_counter() - began
    written = sorted(path.stat().st_mtime for path in (out / "chunks").glob("chunk-*.parquet"))
    chunk = json.loads((out / "summary.json").read_text())["chunk"]
    under_way = len(way.processes)
    steady = (cases - chunk * under_way) / max(written[-1] - written[under_way - 1], 1e-3)
    return {"time_s": wall, "cases_per_s": steady}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("throughput.json"))
    parser.add_argument("--workers", type=int, default=min(2, len(CORES)))
    parser.add_argument("--scenarios", nargs="+", choices=JOBS, default=list(JOBS))
    parser.add_argument("--cases", type=int, help="of each scenario, in place of its own number")
    arguments = parser.parse_args()
    rows, same = [], True
    print(f"{'':14}{'':34}{'cases':>7}{'time, s':>10}{'cases/s':>10}{'times one':>11}")
    with cluster(arguments.workers) as scheduler, tempfile.TemporaryDirectory() as folder:
        for name in arguments.scenarios:
            cases = arguments.cases or JOBS[name]
            # Compiled once and kept for all.
            run(name, FIRST, Way((("--workers", "2"),)), Path(folder) / f"{name}-0")
            tables, first = [], 0.0
            for number, (told, way) in enumerate(ways(arguments.workers, scheduler).items(), start=1):
                out = Path(folder) / f"{name}-{number}"
                found = run(name, cases, way, out)
                tables.append((out / "cases.parquet").read_bytes())
                first = first or found["cases_per_s"]
                row = {"scenario": name, "way": told, "cases": cases, **found, "over_one": found["cases_per_s"] / first}
                rows.append(row)
                print(
                    f"{name:14}{told:34}{cases:7}{row['time_s']:10.1f}{row['cases_per_s']:10.0f}{row['over_one']:11.2f}",
                    flush=True,
                )
            alike = all(table == tables[0] for table in tables)
            same &= alike
            print(f"{name}: all {len(tables)} tables {'are the same bytes' if alike else 'ARE NOT ALIKE'}")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps({"cores": len(CORES), "rows": rows, "same_bytes": same}, indent=1))
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
