"""Times of the whole `jaxsat` process: cold and warm compile cache, a second file in a running process, `--help`.

And of work in a process that has its programs: blind fits of the five sessions of Munin, profiles, draws from the
posterior (BlackJAX), a blind fit of 10 000 samples at 1 Hz (magnetometer, gyro, Sun); with `--day` of 86 400.

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


PROFILED = ("magnet.y", "magnet.z", "rods.y", "rods.z", "inertia.yy", "inertia.xy", "imax", "albedo.diffuse")


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


def inside(samples: int) -> dict[str, object]:
    """Seconds of work in this process, whose programs are compiled."""
    # JAX is set up before anything of it is imported.
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from models.growth_points import day_of

    import fitting
    from fitting.profile.profile import profile
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry import read_telemetry

    def seconds(work) -> float:
        work()
        began = time.perf_counter()
        work()
        return time.perf_counter() - began

    satellite, found = read_satellite(), {}
    for path in sorted(DATA.glob("*.RAW_SUN")):
        session = read_telemetry(path, satellite)
        found[path.stem] = fitting.fit(satellite, session, causes=False), session
    blind = {
        name: seconds(lambda s=session: fitting.fit(satellite, s, causes=False)) for name, (_, session) in found.items()
    }
    of = found["d-mixed-albedo"][0]
    best, parameters = of.found.minima[0], of.found.parameters
    profiles = {name: seconds(lambda n=name: profile(best.problem, parameters, best.refined, n)) for name in PROFILED}
    draws = {"draws": 160, "warmup": 40, "chains": 4}
    day_satellite, day, _ = day_of(samples)
    free = "magnet,inertia,mag.bias,gyro.bias"
    return {
        "blind_s": blind,
        "profile_s": profiles,
        "posterior_800_draws_s": seconds(lambda: fitting.sample_posterior(of, **draws)),
        f"blind_of_{samples}_s": seconds(lambda: fitting.fit(day_satellite, day, causes=False, free=free)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("fit-times.json"))
    parser.add_argument("--day", action="store_true", help="86 400 samples in place of 10 000")
    parser.add_argument("--inside", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.inside:
        print(json.dumps(inside(arguments.inside)))
        return
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
    own = [sys.executable, __file__, "--inside", str(86_400 if arguments.day else 10_000)]
    result |= json.loads(subprocess.run(own, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()[-1])
    print(json.dumps(result, indent=1))
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
