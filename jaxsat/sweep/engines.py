"""Who runs the chunks: threads of this process, or the workers of a dask cluster. Both leave the same files."""

import logging
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from jaxsat.errors import InputError
from jaxsat.sweep.chunks import ChunkDone, chunk_path, run_chunk
from jaxsat.sweep.plan import SweepPlan
from jaxsat.sweep.scenario import Scenario
from jaxsat.sweep.signals import POLL_S, deaf_children, noted_signals
from jaxsat.sweep.source import Source

OnDone = Callable[[ChunkDone], None]
"""Called in the calling thread after each chunk, whose file is then whole."""

_AHEAD = 2
"""Chunks that a dask worker has at hand beside the one it runs."""
_CONNECT_S = 30


def run_local(
    source: Source,
    plan: SweepPlan,
    directory: Path,
    numbers: Sequence[int],
    *,
    on_done: OnDone,
    on_interrupt: Callable[[], None] | None = None,
    workers: int | None = None,
) -> None:
    """Runs chunks in `workers` threads of this process, by default one a core; no more chunks are held than that.

    If anything is raised, also by Ctrl-C, chunks under way are still finished, and no other is begun; `on_interrupt` is
    called before that wait.
    """
    scenario = source.scenario()
    count = workers or _threads()
    pending = iter(numbers)

    with ThreadPoolExecutor(count, thread_name_prefix="chunk") as pool:

        def begin(number):
            return pool.submit(_on_device, scenario, plan, directory, number)

        # One alone at first: its compiled program serves all others.
        running = {begin(number) for number in islice(pending, 1)}
        try:
            with noted_signals() as heed:
                while running:
                    heed()
                    done, running = wait(running, POLL_S, FIRST_COMPLETED)
                    for future in done:
                        on_done(future.result())
                    running |= {begin(number) for number in islice(pending, count - len(running))}
        except KeyboardInterrupt:
            if on_interrupt is not None:
                on_interrupt()
            raise


def _on_device(scenario: Scenario, plan: SweepPlan, directory: Path, number: int) -> ChunkDone:
    """`run_chunk` with the devices taken in turn, where there are several."""
    jax = sys.modules.get("jax")
    devices = [] if jax is None else jax.local_devices()
    if jax is None or len(devices) < 2:
        return run_chunk(scenario, plan, directory, number)
    with jax.default_device(devices[number % len(devices)]):
        return run_chunk(scenario, plan, directory, number)


def _threads() -> int:
    """Two at least, for one to write while another computes; two a device where there are accelerators."""
    jax = sys.modules.get("jax")
    if jax is not None and jax.default_backend() != "cpu":
        return 2 * len(jax.local_devices())
    return max(2, _cores())


def _cores() -> int:
    """Cores that this process may use, which a batch queue may have limited."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def run_dask(
    source: Source,
    plan: SweepPlan,
    directory: Path,
    numbers: Sequence[int],
    *,
    on_done: OnDone,
    workers: int | None = None,
    scheduler: str | None = None,
) -> None:
    """Runs chunks on a dask cluster: that of `scheduler`, or one of `workers` processes on this machine.

    The workers write the files, so they must see `directory` under the same path. Chunks of a worker that dies are
    run by the others. Raises `InputError` where dask.distributed or the cluster is not there.
    """
    try:
        from distributed import KilledWorker, as_completed
    except ImportError:
        raise InputError("needs dask.distributed: pip install 'jaxsat[dask]'", field="engine dask") from None
    directory, pending = directory.absolute(), iter(numbers)
    with _client(scheduler, workers or _cores()) as client, noted_signals() as heed:
        threads = max(1, sum(client.nthreads().values()))

        def begin(number):
            return client.submit(_in_worker, source, plan, directory, number, pure=False)

        running = as_completed([begin(number) for number in islice(pending, (1 + _AHEAD) * threads)])
        while not running.is_empty():
            heed()
            if not running.has_ready():
                time.sleep(POLL_S)
                continue
            future = next(running)
            try:
                done = future.result()
            except KilledWorker:
                raise InputError("its workers die again and again; is there memory enough?", field="dask") from None
            future.release()
            if not chunk_path(directory, done.number).exists():
                raise InputError("the workers of dask do not write here: not the same file system?", file=directory)
            on_done(done)
            for number in islice(pending, 1):
                running.add(begin(number))


def _in_worker(source: Source, plan: SweepPlan, directory: Path, number: int) -> ChunkDone:
    return run_chunk(source.scenario(), plan, directory, number)


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Any]:
    """A client of the given scheduler, or of a cluster that lives as long as the context."""
    from distributed import Client, LocalCluster

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=_CONNECT_S)
        except (OSError, ValueError) as error:
            raise InputError(f"no scheduler answers: {error}", field=scheduler) from None
        with client:
            yield client
        return
    # A process each: a killed one costs its chunk only, and Python's lock is nobody's but its own.
    settings: dict[str, Any] = {
        "n_workers": workers,
        "threads_per_worker": 1,
        "dashboard_address": None,
        "silence_logs": logging.CRITICAL,
        # Which XLA reads: else each worker has a thread for every core, and they get into each other's way.
        "env": {"NPROC": str(max(1, _cores() // workers))},
    }
    with deaf_children():
        cluster = LocalCluster(**settings)
    with cluster, Client(cluster) as client:
        yield client
