"""Our side of the Sun-pointing benchmarks: the sweep's scenario, compiled, on two threads."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from jaxsat.sweep.scenarios import sun_pointing

THREADS, REPEATS = 2, 3


def timed_sweep(estimator: str, *, seed: int, cases: int, chunk: int) -> tuple[float, float, dict[str, np.ndarray]]:
    """Wall and processor time [s] of the fastest of the repeats, nothing compiled in it, and the metrics of all cases.

    `chunk` divides `cases`.
    """
    scenario = sun_pointing.make({"estimator": estimator})
    chunks = np.split(np.arange(cases), cases // chunk)
    scenario.run(seed, chunks[0])
    seconds, found = [], []
    for _ in range(REPEATS):
        began, used = time.perf_counter(), time.process_time()
        with ThreadPoolExecutor(THREADS) as pool:
            found = list(pool.map(lambda chunk: scenario.run(seed, chunk), chunks))
        seconds.append((time.perf_counter() - began, time.process_time() - used))
    return *min(seconds), {name: np.concatenate([part[name] for part in found]) for name in found[0]}
