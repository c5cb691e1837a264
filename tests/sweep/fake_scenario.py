"""A scenario without physics and without JAX: numbers of each case from a generator of its own."""

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from jaxsat.sweep import Factory, Input, Metric, Option, Scenario, number_of

STATUSES = ("succeeded", "too_slow", "lost")


INPUTS = (
    Input("luck", "1", "of which a case needs some", lambda drawn: drawn[:, 0]),
    Input("push", "m/s", "at the start", lambda drawn: 0.5 * drawn[:, 1:], ("x", "y")),
)


def drawn(seed: int, cases: np.ndarray) -> np.ndarray:
    """Three unit normal numbers of each case."""
    return np.array([np.random.default_rng([seed, case]).normal(size=3) for case in cases])


def _build(options: Mapping[str, str]) -> Scenario:
    scale, pause = number_of(options, "scale", low=0.0), number_of(options, "pause_s", low=0.0)

    def run(seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        time.sleep(pause)
        draws = drawn(seed, cases)
        status = np.where(draws[:, 0] > 1.0, 1, np.where(draws[:, 0] < -1.5, 2, 0))
        return {
            "status": status,
            "miss_deg": scale * draws[:, 1],
            "settling_time_s": np.where(status == 0, np.exp(draws[:, 2]), np.nan),
        }

    metrics = {"miss_deg": Metric("deg", "by how much"), "settling_time_s": Metric("s", "how soon; none if failed")}
    chunk = int(number_of(options, "chunk", low=1.0))
    return Scenario("fake", STATUSES, metrics, chunk, run, inputs=INPUTS, draw=drawn)


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


def fine(options: Mapping[str, str]) -> Scenario:
    """A scenario that needs double precision."""
    return replace(make(options), only_float64="it is too fine")


def broken(options: Mapping[str, str]) -> Scenario:
    """A scenario whose every chunk fails on the disk, for what the engines do with it."""

    def run(seed, cases):
        raise OSError(28, "No space left on device", "somewhere")

    return Scenario("broken", STATUSES, {}, 4, run)
