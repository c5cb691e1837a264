"""Times of the whole `jaxsat` process: cold and warm compile cache, a second file in a running process, `--help`.

.venv/bin/python experiments/benchmarks/fit_times.py --out fit-times.json
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

COMMAND = Path(sys.executable).with_name("jaxsat")
DATA = Path(__file__).resolve().parents[2] / "jaxsat" / "data" / "munin"


def timed(arguments: list[str], cache: str) -> tuple[float, float]:
    """Wall seconds and peak memory [GB] of one process, which must succeed."""
    environment = {**os.environ, "XDG_CACHE_HOME": cache}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    began = time.perf_counter()
    process = subprocess.Popen(
        [COMMAND, *arguments], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"jaxsat {' '.join(arguments)}: status {os.waitstatus_to_exitcode(status)}")
    return time.perf_counter() - began, usage.ru_maxrss / 1024**2


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("fit-times.json"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = f"{folder}/fit"
        helps = [timed(["--help"], folder)[0] for _ in range(5)]
        cold, cold_memory = timed(["fit", "--out", out], folder)
        warm = [timed(["fit", "--out", out], folder) for _ in range(3)]
        files = [str(DATA / f"{name}.RAW_SUN") for name in ("b-specular50", "d-mixed-albedo", "e-tumbling")]
        timed(["fit", *files, "--out", f"{folder}/many"], folder)
        second = [
            json.loads(path.read_text())["timing_s"] for path in sorted(Path(folder, "many").glob("*/fit.json"))[1:]
        ]
    result = {
        "help_s": min(helps),
        "cold_s": cold,
        "warm_s": min(seconds for seconds, _ in warm),
        "peak_memory_GB": max(cold_memory, *(memory for _, memory in warm)),
        "second_file_fit_s": [t["prepare"] + t["compile"] + t["solve"] for t in second],
    }
    print(json.dumps(result, indent=1))
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
