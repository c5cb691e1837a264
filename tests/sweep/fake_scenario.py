"""A scenario without physics and without JAX: numbers of each case from a generator of its own."""

import time
from collections.abc import Mapping

import numpy as np

from jaxsat.sweep import Factory, Metric, Option, Scenario, number_of

STATUSES = ("succeeded", "too_slow", "lost")


def _build(options: Mapping[str, str]) -> Scenario:
    scale, pause = number_of(options, "scale", low=0.0), number_of(options, "pause_s", low=0.0)

    def run(seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        time.sleep(pause)
        draws = np.array([np.random.default_rng([seed, case]).normal(size=3) for case in cases])
        status = np.where(draws[:, 0] > 1.0, 1, np.where(draws[:, 0] < -1.5, 2, 0))
        return {
            "status": status,
            "miss_deg": scale * draws[:, 1],
            "settling_time_s": np.where(status == 0, np.exp(draws[:, 2]), np.nan),
        }

    metrics = {"miss_deg": Metric("deg", "by how much"), "settling_time_s": Metric("s", "how soon; none if failed")}
    return Scenario("fake", STATUSES, metrics, int(number_of(options, "chunk", low=1.0)), run)


make = Factory(
    _build,
    (
        Option("scale", "1", "of the miss"),
        Option("pause_s", "0", "that each chunk sleeps"),
        Option("chunk", "8", "cases of a chunk"),
    ),
)


def plain(options: Mapping[str, str]) -> Scenario:
    """A factory that is no more than a function."""
    return make(options)


def broken(options: Mapping[str, str]) -> Scenario:
    """A scenario whose every chunk fails on the disk, for what the engines do with it."""

    def run(seed, cases):
        raise OSError(28, "No space left on device", "somewhere")

    return Scenario("broken", STATUSES, {}, 4, run)
