"""Sun pointing beside Basilisk's Monte Carlo controller: how long do 100 cases of 1500 s take, how many find the Sun?

Both start from the same 100 attitudes and rates, with the same inertia and a control period of 1 s, on two workers. A
case has succeeded if the Sun is within 3 deg of the sensor's axis at the end. Nothing of either is compiled or
imported in the times: the fastest of three, but Basilisk's variants run once. On a shared machine the ratio is that of
processor times, all processes and threads counted. Prints a table, writes JSON; 2 minutes.

    .venv/bin/pip install -e '.[basilisk]'
    .venv/bin/python experiments/benchmarks/sun_pointing_basilisk.py --out sun-basilisk.json
"""

import argparse
import importlib.util
import json
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

CASES, MANY, PERIODS, WORKERS, REPEATS, SEED, HELD_DEG = 100, 10_000, 1500, 2, 3, 0, 3.0
THRUSTER_CASES = 10
"""Each takes as long as ten with an ideal torque."""
DIFFERENCES = """What differs:
- ours reconstructs the Sun from the pyramid sensor with hood and total reflection; Basilisk from four coarse Sun
  sensors by least squares, with about the same hemisphere in view
- our law damps, searches about two axes, slews at a limited rate and holds with a dead band; Basilisk's is MRP feedback
  with a search rotation about one axis, and its gains are not tuned
- our thrusters fire once a period, at least 0.03 s, and act with the mean torque of the period; Basilisk's ideal torque
  has no limit and no pulses; its thrusters are switched within the period, for which dynamics run at 0.1 s
- Basilisk also integrates position and velocity, and writes the parameters of every case; it keeps the last attitude
  of a case, we ten metrics
- the controller forks its workers anew for every two cases; 'no controller' is the same simulations in a plain loop"""


def basilisk(*job, workers: int, repeats: int) -> tuple[float, float, np.ndarray]:
    """Wall and processor time [s] of the fastest repeat, and the angle of the Sun from the axis at the end [deg].

    For a process of its own. `job` is what `sun_pointing_bsk.run` takes, from quaternions to thruster.
    """
    from models import sun_pointing_bsk

    # A spawned process would spawn: then the controller imports Basilisk anew for every two cases.
    multiprocessing.set_start_method("fork", force=True)
    quaternions, rates, *vehicle = job
    sun_pointing_bsk.run(quaternions[:2], rates[:2], *vehicle, periods=10, workers=workers)
    runs = [sun_pointing_bsk.run(*job, periods=PERIODS, workers=workers) for _ in range(repeats)]
    return min(runs, key=lambda run: run[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("sun-basilisk.json"))
    arguments = parser.parse_args()
    if importlib.util.find_spec("Basilisk") is None:
        sys.exit("Basilisk is not installed: pip install -e '.[basilisk]'")

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from models.sun_pointing_ours import timed_sweep

    from jaxsat.control.sun_pointing.draw import Dispersions, draw_cases
    from jaxsat.control.sun_pointing.vehicle import (
        BODY_FROM_INSTRUMENT,
        INERTIA_KG_M2,
        LEVER_M,
        MIN_PULSE_S,
        TORQUE_N_M,
    )
    from jaxsat.sweep import case_keys
    from jaxsat.sweep.scenarios import sun_pointing

    drawn = draw_cases(Dispersions(), case_keys(SEED, np.arange(CASES)))
    starts = (np.asarray(drawn.quaternion), np.asarray(drawn.angular_velocity))
    rows = {}

    ideal = (*starts, INERTIA_KG_M2, BODY_FROM_INSTRUMENT, None)
    few = tuple(start[:THRUSTER_CASES] for start in starts)
    pulsed = (*few, INERTIA_KG_M2, BODY_FROM_INSTRUMENT, (TORQUE_N_M[0] / LEVER_M / 2.0, LEVER_M, MIN_PULSE_S))
    # The controller forks, so it gets a process in which there is no JAX with its threads.
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        for name, job, workers, repeats in (
            ("Basilisk, ideal torque", ideal, WORKERS, REPEATS),
            ("Basilisk, ideal torque, one core, no controller", ideal, 0, 1),
            ("Basilisk, thrusters", pulsed, WORKERS, 1),
        ):
            print(f"measuring: {name}", file=sys.stderr)
            rows[name] = _row(*pool.submit(basilisk, *job, workers=workers, repeats=repeats).result())

    for estimator in ("published", "tracking"):
        for cases, chunk in ((CASES, CASES // WORKERS), (MANY, sun_pointing.CHUNK)):
            print(f"measuring: ours, {estimator}, {cases} cases", file=sys.stderr)
            wall, used, found = timed_sweep(estimator, seed=SEED, cases=cases, chunk=chunk)
            rows[f"ours, {estimator}, {cases} cases"] = _row(wall, used, found["final_error_deg"])

    least = rows["Basilisk, ideal torque"]["processor_s_per_case"]
    print(f"{'':48}{'cases':>7}{'succeeded':>11}{'time, s':>10}{'cases/s':>10}{'CPU ms a case':>15}{'ratio':>8}")
    for name, row in rows.items():
        row["ratio"] = least / row["processor_s_per_case"]
        speed = f"{row['time_s']:>10.3g}{row['cases_per_s']:>10.4g}{1e3 * row['processor_s_per_case']:>15.3g}"
        print(f"{name:48}{row['cases']:>7}{row['succeeded']:>11}{speed}{row['ratio']:>8.3g}")
    print(
        "ratio: of the processor time of a case, Basilisk with ideal torque and its controller over this",
        DIFFERENCES,
        sep="\n",
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(rows, indent=1))


def _row(wall: float, used: float, off_deg: np.ndarray) -> dict[str, float]:
    cases = len(off_deg)
    return {
        "cases": cases,
        "succeeded": int(np.sum(off_deg < HELD_DEG)),
        "time_s": wall,
        "cases_per_s": cases / wall,
        "processor_s_per_case": used / cases,
    }


if __name__ == "__main__":
    main()
