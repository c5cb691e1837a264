"""Every speed that README and docs tell, made anew: ours, the peer's, their ratio, the command, and where it stands.

Runs the scripts of this directory one after the other, each a process with a time limit, and reads their JSON; a
script whose peer is not installed, or that takes too long, is told and its figures are left empty. Ratios of one run
are what to trust. Writes all.json, ratios.png and each script's own files. How long each may take stands in `SCRIPTS`:
most take a minute or two, integrators and growth six.

    .venv/bin/pip install -e '.[benchmarks,basilisk,dask]'
    .venv/bin/python experiments/benchmarks/all.py --out benchmarks
    .venv/bin/python experiments/benchmarks/all.py --only integrators fit_peers
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = Path(__file__).resolve().parent
FASTER: dict[str, Any] = {"color": "#1a6fb5"}
SLOWER: dict[str, Any] = {"color": "#d98e00", "hatch": "///", "edgecolor": "white"}
"""How bars look."""


@dataclass(frozen=True)
class Script:
    """A script, what it is told, and how long it may take [s]."""

    options: tuple[str, ...] = ()
    limit: float = 300.0
    quick: tuple[str, ...] | None = None
    """Options of `--quick`; None: too long for it, left out."""
    file: str = ""
    """Its JSON, where `--out` is a directory; else `--out` is the file."""
    peer: str = ""
    """Module without which it does not run."""
    folder: str = "experiments/benchmarks"


SCRIPTS = {
    "integrators": Script(limit=600.0, peer="heyoka"),
    "precision": Script(limit=180.0, quick=()),
    "growth": Script(limit=540.0, file="growth.json", quick=("--minutes", "2")),
    "gpu": Script(limit=540.0, quick=()),
    "hysteresis": Script(limit=400.0, file="hysteresis.json", quick=("--quick",), folder="experiments"),
    "fit_times": Script(limit=200.0),
    "fit_peers": Script(limit=600.0, peer="numba"),
    "munin_suite": Script(limit=200.0, quick=("--samples", "1000", "--repeats", "1")),
    "sun_pointing_peers": Script(limit=200.0, peer="numba", quick=()),
    "sun_pointing_basilisk": Script(limit=400.0, peer="Basilisk"),
    "detumble_basilisk": Script(limit=300.0, peer="Basilisk"),
    "earth_search_peers": Script(limit=300.0, peer="numba"),
    "throughput": Script(limit=300.0, peer="distributed"),
    "gpu_sweeps": Script(limit=540.0, quick=("--scenarios", "sun-pointing", "--cases", "512")),
}
"""In the order in which they run."""


@dataclass(frozen=True)
class Figure:
    """One figure: where in the script's JSON it is, the peer's beside it, and the page that tells it.

    A place is keys with slashes between, as `single/run_ms`; of a list `name=value` is the row that has it.
    """

    what: str
    unit: str
    script: str
    ours: str
    peer: tuple[str, str] | None
    page: str
    faster_is_more: bool = False
    """Whether the figure is a rate."""


SPEED, FIT = "docs/speed.md", "docs/peers.md"
LM = "local/name=ours, LM"
FIGURES = (
    Figure("10 000 attitudes; heyoka as documented", "s", "integrators", "job/jaxsat/best_s",
           ("heyoka", "job/heyoka_library/best_s"), SPEED),
    Figure("10 000 attitudes; heyoka tuned", "s", "integrators", "job/jaxsat/best_s",
           ("heyoka", "job/heyoka_tuned/best_s"), SPEED),
    Figure("10 000 attitudes; RK4", "s", "integrators", "job/jaxsat/best_s", ("numba", "job/numba_rk4/best_s"), SPEED),
    Figure("10 000 attitudes; order 8, generated", "s", "integrators", "job/jaxsat/best_s",
           ("numba", "job/numba_rk8/best_s"), SPEED),
    Figure("10 000 attitudes, step found", "s", "integrators", "job/jaxsat_tolerance/best_s",
           ("heyoka", "job/heyoka_tuned/best_s"), SPEED),
    Figure("7 x 13 sensitivities of 512", "s", "integrators", "job/sensitivities/best_s",
           ("heyoka", "job/heyoka_sensitivities/best_s"), SPEED),
    Figure("7 x 13 sensitivities of one", "s", "integrators", "job/sensitivities_single/best_s",
           ("heyoka", "job/heyoka_sensitivities_single/best_s"), SPEED),
    Figure("one trajectory, 1e-6", "ms", "integrators", "single/run_ms", None, SPEED),
    Figure("its gradient, reverse mode", "ms", "integrators", "single/gradient_ms", None, SPEED),
    Figure("IGRF 13 at 2000 points", "ms", "integrators", "igrf_2000_nodes/run_ms", None, SPEED),
    Figure("ten days, compiled and run", "s", "integrators", "ten_days/seconds", None, SPEED),
    Figure("single precision, worst error of q", "1", "precision", "precision=float32/worst", None, SPEED),
    Figure("growth: slope over cases", "1", "growth", "slopes/cases/cpu_s", None, SPEED),
    Figure("growth: slope over samples of a fit", "1", "growth", "slopes/samples/cpu_s", None, SPEED),
    Figure("3 days with rods, 1e-6", "s", "hysteresis", "3 days, one, 1e-06 rad/clock_s", None, "docs/python.md"),
    Figure("jaxsat --help", "s", "fit_times", "help_s", None, "docs/figures.md"),
    Figure("jaxsat fit, nothing compiled", "s", "fit_times", "cold_s", None, "docs/figures.md"),
    Figure("jaxsat fit, warm", "s", "fit_times", "warm_s", None, "docs/figures.md"),
    Figure("local fit, 17 unknowns; NumPy", "s", "fit_peers", LM + "/best_s",
           ("SciPy", "local/name=SciPy LM, NumPy, columns at once/best_s"), FIT),
    Figure("local fit, 17 unknowns; numba", "s", "fit_peers", LM + "/best_s",
           ("SciPy", "local/name=SciPy LM, numba, column after column/best_s"), FIT),
    Figure("OrbfiGraf, 10 000 samples", "s", "munin_suite", "programs/field roll (OrbfiGraf)/warm_s", None,
           "docs/munin-suite.md"),
    Figure("10 000 Sun pointings", "s", "sun_pointing_peers", "ours_10000_s",
           ("numba", "numba_10000_two_cores_s"), "docs/papers/sun-pointing.md"),
    Figure("a Sun pointing, processor time", "s", "sun_pointing_basilisk",
           "ours, published, 10000 cases/processor_s_per_case",
           ("Basilisk", "Basilisk, ideal torque/processor_s_per_case"), "docs/papers/sun-pointing.md"),
    Figure("a detumbling, processor time", "s", "detumble_basilisk", "rows/ours, 2000 cases/processor_s_per_case",
           ("Basilisk", "rows/Basilisk/processor_s_per_case"), "docs/scenarios/detumble.md"),
    Figure("10 000 Earth searches, processor time", "s", "earth_search_peers", "ours_plain_10000_processor_s",
           ("numba", "numba_10000_processor_s"), "docs/papers/earth-search.md"),
    Figure("detumblings a second, two threads", "1/s", "throughput",
           "rows/way=one process, 2 threads/cases_per_s", None, "docs/howto/clusters.md", True),
    Figure("detumblings a second, float32; float64", "1/s", "gpu_sweeps",
           "rows/precision=float32/cases_per_s", ("float64", "rows/precision=float64/cases_per_s"),
           "docs/howto/clusters.md", True),
)  # fmt: skip
"""In the order of the table. A figure that a script tells and no page repeats is not here."""


def looked_up(document: Any, place: str) -> float | None:
    """What is at a place of a document; None where it is not there."""
    for key in place.split("/"):
        if isinstance(document, dict) and "=" in key and key not in document:
            document = list(document.values())
        if isinstance(document, list):
            name, _, value = key.partition("=")
            document = next((row for row in document if str(row.get(name)) == value), None)
        elif isinstance(document, dict):
            # A key may go on with what depends on options: `Basilisk, 200 cases`.
            begun = [each for each in document if each.startswith(key)]
            document = document.get(key, document[begun[0]] if len(begun) == 1 else None)
        if document is None:
            return None
    return float(document) if isinstance(document, (int, float)) else None


def run(name: str, script: Script, options: tuple[str, ...], out: Path) -> tuple[dict[str, Any], Any]:
    """How a script ended, and its JSON."""
    target = out / name if script.file else out / f"{name}.json"
    if script.file:
        target.mkdir(parents=True, exist_ok=True)
    words = [f"{script.folder}/{name}.py", *options, "--out", str(target)]
    told: dict[str, Any] = {"command": shlex.join([".venv/bin/python", *words]), "ended": "done"}
    path, began = os.pathsep.join((str(HERE.parents[1]), os.environ.get("PYTHONPATH", ""))), time.perf_counter()
    with (out / f"{name}.log").open("w") as log:
        try:
            done = subprocess.run(
                [sys.executable, *words], cwd=HERE.parents[1], stdout=log, stderr=subprocess.STDOUT,
                timeout=script.limit, env={**os.environ, "PYTHONPATH": path},
            )  # fmt: skip
            if done.returncode:
                last = (out / f"{name}.log").read_text().strip().splitlines()
                told["ended"] = f"status {done.returncode}: {last[-1][:100] if last else ''}"
        except subprocess.TimeoutExpired:
            told["ended"] = f"not ended after {script.limit:.0f} s"
    told["seconds"] = time.perf_counter() - began
    file = target / script.file if script.file else target
    return told, json.loads(file.read_text()) if told["ended"] == "done" and file.exists() else None


def has(module: str) -> bool:
    """Whether Python finds a module; asked of another process, which may look for it as it likes."""
    script = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({module!r}) is None)"
    return subprocess.run([sys.executable, "-c", script]).returncode == 0


def picture(rows: list[dict[str, Any]], out: Path) -> None:
    """Bars of the ratios: blue beyond 1, where we are faster; orange and hatched below it."""
    rows = [row for row in rows if row["ratio"]]
    figure, axis = plt.subplots(figsize=(9.0, 1.0 + 0.32 * len(rows)), layout="constrained")
    names = [f"{row['what']} ({row['peer_name']})" for row in rows]
    # Told apart with red-green blindness and in print too.
    for label, faster, look in (("faster", True, FASTER), ("slower", False, SLOWER)):
        ratios = [row["ratio"] if (row["ratio"] >= 1.0) is faster else float("nan") for row in rows]
        axis.barh(names, ratios, label=label, **look)
    axis.legend(loc="lower right", frameon=False)
    for place, row in enumerate(rows):
        axis.text(row["ratio"], place, f" {row['ratio']:.2g}", va="center", fontsize=9)
    axis.axvline(1.0, color="black", lw=0.8)
    axis.set_xscale("log")
    axis.margins(x=0.15)
    axis.invert_yaxis()
    axis.set_xlabel("times as fast as the peer")
    figure.savefig(out, dpi=110)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("benchmarks"), help="directory")
    parser.add_argument("--only", nargs="+", choices=SCRIPTS, help="scripts to run")
    parser.add_argument("--quick", action="store_true", help="those that are short, with few cases: tries this script")
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    ended, found = {}, {}
    for name in arguments.only or SCRIPTS:
        script = SCRIPTS[name]
        options = script.quick if arguments.quick else script.options
        if script.peer and not has(script.peer):
            ended[name] = {"ended": f"left out: {script.peer} is not installed"}
        elif options is None:
            ended[name] = {"ended": "left out: too long for --quick"}
        else:
            print(f"{name:23}at most {script.limit:.0f} s ...", end=" ", flush=True)
            ended[name], found[name] = run(name, script, options, out)
            print(f"{ended[name]['ended']}, {ended[name]['seconds']:.0f} s", flush=True)
            continue
        print(f"{name:23}{ended[name]['ended']}", flush=True)
    rows = []
    print(f"\n{'':43}{'':5}{'ours':>10}{'peer':>10}{'ratio':>8}  of")
    for figure in FIGURES:
        if figure.script not in ended:
            continue
        document = found.get(figure.script)
        ours = looked_up(document, figure.ours)
        peer = looked_up(document, figure.peer[1]) if figure.peer else None
        ratio = (ours / peer if figure.faster_is_more else peer / ours) if ours and peer else None
        name = figure.peer[0] if figure.peer else None
        rows.append({**asdict(figure), "value": ours, "peer_value": peer, "peer_name": name, "ratio": ratio,
                     "command": ended[figure.script].get("command")})  # fmt: skip
        cells = [("-" if value is None else f"{value:.3g}") for value in (ours, peer, ratio)]
        place = f"{name or '':9}{figure.page:32}{figure.script}"
        print(f"{figure.what:43}{figure.unit:5}{cells[0]:>10}{cells[1]:>10}{cells[2]:>8}  {place}")
    print("ratio: how many times as fast as the peer we are; the last columns: page, script")
    document = {"cores": os.cpu_count(), "quick": arguments.quick, "scripts": ended, "figures": rows}
    (out / "all.json").write_text(json.dumps(document, indent=1))
    if any(row["ratio"] for row in rows):
        picture(rows, out / "ratios.png")


if __name__ == "__main__":
    main()
