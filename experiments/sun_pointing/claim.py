"""Does Sun pointing work despite the errors of its sensor, as Zhukov 2019 claims of 10 000 cases? Three estimators.

The claim is about his estimator on a perfect vehicle; beside it a vehicle that is off in everything. Prints a table,
writes JSON. `jaxsat sweep sun-pointing` is the same with files and pictures of the cases.

    .venv/bin/python experiments/sun_pointing/claim.py --cases 10000 --out out/sun-claim.json
"""

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

OFF = {
    "inertia": "0.05",
    "thrust": "0.1",
    "thruster_deg": "2",
    "mounting_deg": "0.5",
    "gyro_bias_deg_s": "0.002",
    "gyro_noise_deg_s": "0.005",
    "detector_failures": "0.3",
    "reading_noise": "0.005",
    "reading_bits": "10",
}
VEHICLES = {"perfect": {}, "everything off": OFF}
SHOWN = ("settling_time_s", "search_time_s", "slew_time_s", "impulse_N_s", "final_error_deg", "worst_estimate_deg")


def study(options: dict[str, str], cases: int, seed: int) -> dict:
    """Counts by status, failing cases, and percentiles of all metrics."""
    from jaxsat.sweep.scenarios import sun_pointing

    scenario = sun_pointing.make(options)
    chunks = np.split(np.arange(-(-cases // scenario.chunk) * scenario.chunk), -(-cases // scenario.chunk))
    scenario.run(seed, chunks[0])
    began = time.perf_counter()
    # XLA runs such a program on one core and releases the GIL.
    with ThreadPoolExecutor(2) as pool:
        parts = list(pool.map(lambda numbers: scenario.run(seed, numbers), chunks))
    seconds = time.perf_counter() - began
    found = {name: np.concatenate([part[name] for part in parts])[:cases] for name in parts[0]}
    status = found.pop("status")
    return {
        "options": options,
        "seconds_warm": seconds,
        "status": {name: int(np.sum(status == k)) for k, name in enumerate(scenario.statuses)},
        "failed": np.flatnonzero(status > 0).tolist(),
        "metrics": {
            name: dict(
                zip(("p05", "p50", "p95", "max"), np.nanquantile(v, [0.05, 0.5, 0.95, 1.0]).tolist(), strict=True)
            )
            for name, v in found.items()
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("sun-claim.json"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    results = []
    print("| vehicle | estimator | succeeded | " + " | ".join(f"{name} p50, p95" for name in SHOWN) + " | warm, s |")
    print("|---" * (len(SHOWN) + 4) + "|")
    for vehicle, options in VEHICLES.items():
        for estimator in ("published", "tracking", "filter"):
            found = study({**options, "estimator": estimator}, arguments.cases, arguments.seed)
            results.append({"vehicle": vehicle, "estimator": estimator, **found})
            shown = (found["metrics"][name] for name in SHOWN)
            row = " | ".join(f"{each['p50']:.4g}, {each['p95']:.4g}" for each in shown)
            share = f"{found['status']['succeeded']} of {arguments.cases}"
            print(f"| {vehicle} | {estimator} | {share} | {row} | {found['seconds_warm']:.1f} |", flush=True)
            # Written after each, so that a long study can be stopped.
            arguments.out.parent.mkdir(parents=True, exist_ok=True)
            arguments.out.write_text(json.dumps({"seed": arguments.seed, "runs": results}, indent=1))


if __name__ == "__main__":
    main()
