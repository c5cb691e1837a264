"""Our side of the Sun-pointing benchmarks: the sweep's scenario, compiled, on two threads."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from jaxsat.sweep import sun_pointing

THREADS, REPEATS = 2, 3


def timed_sweep(estimator: str, *, seed: int, cases: int, chunk: int) -> tuple[float, dict[str, np.ndarray]]:
    """Fastest wall time of the repeats [s], nothing compiled in it, and the metrics of all cases.

    `chunk` divides `cases`.
    """
    scenario = sun_pointing.make({"estimator": estimator})
    chunks = np.split(np.arange(cases), cases // chunk)
    scenario.run(seed, chunks[0])
    seconds, found = [], []
    for _ in range(REPEATS):
        began = time.perf_counter()
        with ThreadPoolExecutor(THREADS) as pool:
            found = list(pool.map(lambda chunk: scenario.run(seed, chunk), chunks))
        seconds.append(time.perf_counter() - began)
    return min(seconds), {name: np.concatenate([part[name] for part in found]) for name in found[0]}
