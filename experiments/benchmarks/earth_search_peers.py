"""10 000 Earth searches: wall and processor time, and beside the same loop in numba: do both find the same?

All brightness, Moon and Sun for the figure; for the peer an even Earth without them. Both are float64, a control period
of 4 s, an hour, the published strategy. Numba runs 100 cases on one core; times of 10 000 are to scale. Prints, writes
JSON.

    .venv/bin/pip install -e '.[benchmarks]'
    .venv/bin/python experiments/benchmarks/earth_search_peers.py --out earth-peers.json
"""

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

CASES, PEER_CASES, SEED = 10_000, 100, 0
THREADS, REPEATS = 2, 3
PLAIN = {"brightness": "even", "moon": "no", "sun": "none"}


def timed_sweep(options: dict[str, str]) -> tuple[float, float, dict[str, np.ndarray]]:
    """Least wall and processor time [s] of the repeats, nothing compiled in them, and the metrics of all cases."""
    from jaxsat.sweep.scenarios import earth_search

    scenario = earth_search.make(options)
    chunks = np.split(np.arange(CASES), CASES // scenario.chunk)
    scenario.run(SEED, chunks[0])
    walls, used, parts = [], [], []
    for _ in range(REPEATS):
        began, begun = time.perf_counter(), time.process_time()
        with ThreadPoolExecutor(THREADS) as pool:
            parts = list(pool.map(lambda chunk: scenario.run(SEED, chunk), chunks))
        walls.append(time.perf_counter() - began)
        used.append(time.process_time() - begun)
    return min(walls), min(used), {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def peer() -> tuple[float, np.ndarray]:
    """Time [s] of the cases in numba, on one core, and first capture, last capture and mode of each."""
    from models.earth_search_numba import all_cases

    from jaxsat.control.earth_search.draw import Dispersions, draw_cases
    from jaxsat.control.earth_search.law import search_law
    from jaxsat.control.earth_search.vehicle import nominal_vehicle
    from jaxsat.sweep import case_keys

    cases = draw_cases(Dispersions(even=True), case_keys(SEED, np.arange(PEER_CASES)))
    law, vehicle = search_law(), nominal_vehicle()
    names = ("search_rate", "approach_rate", "track_rate", "search_turn", "track_gain", "drift_gain")
    motion = (cases.quaternion, cases.angular_velocity, cases.up, cases.along, cases.orbital_rate)
    given: tuple[Any, ...] = (
        *(np.array(x) for x in (*motion, cases.scene.disk, cases.scene.brightness)),
        np.array([*(float(getattr(law, name)) for name in names), *law.search_direction]),
        tuple(float(getattr(vehicle.sensor, name)) for name in ("cone_angle", "amplitude", "threshold")),
        (float(vehicle.acceleration), float(vehicle.lag)),
        4.0,
    )
    run: Any = all_cases
    run(*given, 1)
    began = time.process_time()
    found = run(*given, 900)
    return time.process_time() - began, found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("earth-peers.json"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    peer_s, theirs = peer()
    wall_s, used_s, _ = timed_sweep({})
    _, plain_s, found = timed_sweep(PLAIN)
    ours = np.stack([found["first_capture_s"], found["captures"]], axis=1)[:PEER_CASES]
    first = np.where(np.isnan(ours[:, 0]), np.inf, ours[:, 0])
    same = first == theirs[:, 0]
    tracks = np.isin(found["status"][:PEER_CASES], (0, 3, 5)) == (theirs[:, 2] == 2.0)
    searched = found["search_time_s"][:PEER_CASES]
    held = np.isfinite(searched)
    same_search = searched[held] == theirs[held, 1]
    scaled = peer_s * CASES / PEER_CASES
    result = {
        "ours_10000_wall_s": wall_s,
        "ours_10000_processor_s": used_s,
        "ours_plain_10000_processor_s": plain_s,
        "numba_100_s": peer_s,
        "numba_10000_processor_s": scaled,
        "cases": PEER_CASES,
        "same_first_capture": int(same.sum()),
        "same_end": int(tracks.sum()),
        "same_search_time": [int(same_search.sum()), int(held.sum())],
    }
    print(f"10 000 searches, two threads: {wall_s:.2f} s, {used_s:.2f} s of processor time")
    print(
        f"even Earth, no Sun, no Moon: ours {plain_s:.2f} s of processor time, numba {scaled:.2f} s to scale, "
        f"{scaled / plain_s:.1f} times ours"
    )
    print(
        f"of {PEER_CASES}: {result['same_first_capture']} are first captured in the same period, {result['same_end']} "
        f"end alike; of {held.sum()} that are found {same_search.sum()} have the same search time"
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
