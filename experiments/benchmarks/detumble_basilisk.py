"""Detumbling beside Basilisk's Monte Carlo controller: how long do the same cases take, and do they end alike?

Both start from the same attitudes and rates and run the same physics: gravity gradient on a Kepler orbit, one centred
dipole that does not turn, perfect readings of field and rate, dipoles -k B x w / B^2 cut at their largest, a control
period of 2 s, RK4 in steps of 0.5 s (`--step`), two orbits. Both have two workers: Basilisk two processes of its
controller, ours two threads. Nothing of either is compiled or imported in the times; the fastest of two. Prints a table
and the largest difference of the rates at the end, writes JSON; a minute.

    .venv/bin/pip install -e '.[basilisk]'
    .venv/bin/python experiments/benchmarks/detumble_basilisk.py --out detumble-basilisk.json

With `--python` Basilisk runs in another interpreter, as one of an environment of its own.
"""

import argparse
import dataclasses
import functools
import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from jaxsat.constants import EARTH_MU
from jaxsat.control.loops import timeline
from jaxsat.environment import InternalField, KeplerOrbit, Sun, Surroundings, igrf_field
from jaxsat.numerics import set_up_jax
from jaxsat.sweep.scenarios import detumble

CASES, MANY, WORKERS, REPEATS, SEED = 60, 2000, 2, 2, 1
RADIUS, INCLINATION, NODE = 6.878137e6, np.radians(97.4), 0.3
OPTIONS = {"law": "gyro", "sensors": "perfect", "pressure": "off", "spread": "0", "duty": "1"}
SCRIPT = Path(__file__).parent / "models" / "detumble_bsk.py"
DIFFERENCES = """What differs:
- Basilisk holds the field over a step of its integration, ours has it at each stage: the difference goes with the step
- Basilisk integrates position and velocity with every case, ours tabulates them and the field once for all
- Basilisk moves one case at a time in a process, ours a chunk of them in one program
- the controller forks its workers anew for every two cases; it keeps the last rate of a case, we five metrics"""


def program(step: str):
    """The loops of the sweep and its metrics, over the dipole and the orbit that both have."""
    cases, metrics = detumble._program(tuple(detumble.make.filled({**OPTIONS, "step_s": step}).items()))
    main = igrf_field(2026.0)
    field = InternalField(main.g[:2, :2], main.h[:2, :2], main.radius)
    orbit = KeplerOrbit(RADIUS, 0.0, INCLINATION, NODE, 0.0, 0.0)
    around = Surroundings(orbit, field, 0.0, 0.0, sun=Sun(0.26))
    periods = cases.schedule.periods(2.0 * cases.flight.orbit_s)
    table = functools.cache(lambda: timeline(around, cases.schedule, periods))
    return dataclasses.replace(cases, timeline=table), metrics, field, orbit, periods


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("detumble-basilisk.json"))
    parser.add_argument("--python", default=sys.executable, help="interpreter that has Basilisk")
    parser.add_argument("--step", default="0.5", help="of the integration of both, s")
    parser.add_argument("--cases", type=int, default=CASES, help="an even number")
    arguments = parser.parse_args()
    set_up_jax()
    few, (cases, metrics, field, orbit, periods) = arguments.cases, program(arguments.step)

    def ours(count: int, chunk: int):
        """Wall and processor time [s] of the fastest of the repeats, and the rates at the end [deg/s]."""
        chunks = np.split(np.arange(count), count // chunk)

        def run(numbers):
            return np.asarray(metrics(cases.run(cases.draw(SEED, numbers)), cases.timeline().last)["final_rate_deg_s"])

        run(chunks[0])
        found = []
        for _ in range(REPEATS):
            began, used = time.perf_counter(), time.process_time()
            with ThreadPoolExecutor(WORKERS) as pool:
                rates = np.concatenate(list(pool.map(run, chunks)))
            found.append((time.perf_counter() - began, time.process_time() - used, rates))
        return min(found, key=lambda each: each[0])

    rows, sized = {}, ((few, few // WORKERS), (MANY, detumble.CHUNK))
    for count, chunk in sized:
        rows[f"ours, {count} cases"] = ours(count, chunk)
    drawn = cases.draw(SEED, np.arange(few))
    rows[f"Basilisk, {few} cases"] = theirs(arguments.python, cases, drawn, field, orbit, periods)

    wall, used, rates = rows[f"Basilisk, {few} cases"]
    own = rows[f"ours, {few} cases"][2]
    apart = float(np.abs(rates - own).max())
    print(f"{'':24}{'time, s':>10}{'cases/s':>10}{'ms a case':>11}{'CPU ms a case':>15}{'ratio':>8}{'CPU ratio':>11}")
    told = {}
    for name, (seconds, processor, found) in rows.items():
        each, cpu = seconds / len(found), processor / len(found)
        ratios = {"ratio": wall / few / each, "processor_ratio": used / few / cpu}
        told[name] = {"cases": len(found), "time_s": seconds, "s_per_case": each, "processor_s_per_case": cpu, **ratios}
        numbers = f"{seconds:>10.3g}{1.0 / each:>10.4g}{1e3 * each:>11.3g}{1e3 * cpu:>15.3g}"
        print(f"{name:24}{numbers}{ratios['ratio']:>8.3g}{ratios['processor_ratio']:>11.3g}")
    print("ratio: of the time of a case, Basilisk's over this; the processor's is what to trust on a shared machine")
    print(f"rates at the end: {np.median(own):.4g} deg/s (median); largest difference of a case {apart:.1e} deg/s")
    print(DIFFERENCES)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps({"rows": told, "rates_apart_deg_s": apart, "step_s": arguments.step}, indent=1))


def theirs(python: str, cases, drawn, field, orbit, periods: int):
    """The same of Basilisk."""
    schedule, torquers = cases.schedule, cases.torquers
    position, velocity = (np.array(x) for x in orbit(jnp.zeros(())))
    g, h = np.array(field.g), np.array(field.h)
    case = {
        "quaternions": np.array(drawn.motion.quaternion),
        "rates": np.array(drawn.motion.angular_velocity),
        "inertia": np.array(cases.nominal.spacecraft.inertia),
        "axes": np.array(torquers.axes),
        "max_dipole": np.array(torquers.max_dipole),
        "gain": np.array(cases.controller.gain),
        "dipole": np.array([g[1, 0], g[1, 1], h[1, 1]]),
        "radius": np.array(field.radius),
        "mu": EARTH_MU,
        "position": position,
        "velocity": velocity,
        "period_s": schedule.period_s,
        "step_s": schedule.step_s,
        "duration_s": periods * schedule.period_s,
        "workers": WORKERS,
        "repeats": REPEATS,
    }
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder) / "cases.npz", Path(folder) / "ends.npz"
        np.savez(given, **case)
        done = subprocess.run([python, str(SCRIPT), str(given), str(found)], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"Basilisk: {done.stderr.strip().splitlines()[-1] if done.stderr else 'failed'}")
        with np.load(found) as ends:
            size = np.degrees(np.linalg.norm(ends["rates"], axis=1))
            return float(ends["wall"]), float(ends["used"]), size


if __name__ == "__main__":
    main()
