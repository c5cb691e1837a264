"""A scenario without physics for `kills`: throws at a target, slowly enough to be killed between them."""

import time
from collections.abc import Mapping

import numpy as np

from jaxsat.sweep import Factory, Metric, Scenario


def _build(options: Mapping[str, str]) -> Scenario:
    def run(seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        time.sleep(0.05)
        miss = np.array([np.random.default_rng([seed, case]).normal() for case in cases])
        return {"status": np.where(np.abs(miss) < 1.0, 0, 1), "miss_m": miss}

    return Scenario("throws", ("succeeded", "missed"), {"miss_m": Metric("m", "by how much")}, 10, run)


make = Factory(_build)
