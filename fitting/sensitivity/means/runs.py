"""All runs of a study of slopes: each case as it is, and on both sides of each push, chunk by chunk in threads."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any

import numpy as np

from jaxsat.sweep.scenario import Scenario, checked_cases
from jaxsat.sweep.signals import POLL_S, noted_signals

Done = Callable[[int], None]
"""Called in the calling thread with the number of cases that were run."""


def run_all(
    scenario: Scenario, seed: int, moves: Sequence[np.ndarray], *, done: Done | None = None
) -> list[dict[str, np.ndarray]]:
    """Status and metrics [cases] for each of `moves` [cases knobs], from the same random numbers."""
    moved = scenario.run_moved
    if moved is None:
        raise ValueError(f"scenario {scenario.name} has no knobs")

    def one(numbers, own):
        return checked_cases(scenario, moved(seed, numbers, own), numbers)

    return in_chunks(scenario, moves, one, done=done)


def in_chunks(
    scenario: Scenario,
    moves: Sequence[np.ndarray],
    one: Callable[[np.ndarray, np.ndarray], dict[str, np.ndarray]],
    *,
    done: Done | None = None,
) -> list[dict[str, np.ndarray]]:
    """What `one(numbers, moves of them)` gives for all chunks of all `moves`, put together for each of these.

    Chunks have one shape: a study of fewer cases than a sweep's chunk has a chunk of its own.
    """
    cases = len(moves[0])
    size = min(scenario.chunk, cases)
    jobs = [(which, begin) for which in range(len(moves)) for begin in range(0, cases, size)]
    parts: dict[tuple[int, int], dict[str, np.ndarray]] = {}

    def work(job):
        which, begin = job
        own = moves[which][begin : begin + size]
        filled = np.concatenate([own, np.zeros((size - len(own), own.shape[1]))])
        found = one(begin + np.arange(size, dtype=np.int64), filled)
        return job, {name: values[: len(own)] for name, values in found.items()}

    for job, found in _threaded(work, jobs):
        parts[job] = found
        if done is not None:
            done(min(size, cases - job[1]))
    names = parts[jobs[0]]
    return [
        {name: np.concatenate([parts[which, begin][name] for begin in range(0, cases, size)]) for name in names}
        for which in range(len(moves))
    ]


def _threaded(work: Callable[[Any], Any], jobs: Sequence[Any]) -> Iterator[Any]:
    """Results of jobs as they come; what is under way when anything is raised is finished."""
    count, pending = max(2, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 2), iter(jobs)
    with ThreadPoolExecutor(count, thread_name_prefix="slopes") as pool:
        # One alone at first: its compiled program serves all others.
        running = {pool.submit(work, job) for job in islice(pending, 1)}
        with noted_signals() as heed:
            while running:
                heed()
                finished, running = wait(running, POLL_S, FIRST_COMPLETED)
                for future in finished:
                    yield future.result()
                running |= {pool.submit(work, job) for job in islice(pending, count - len(running))}
