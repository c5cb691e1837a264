"""The engines run every chunk once, stop at the first error, and leave the same files."""

import gc
import os
import signal
import threading

import pytest

from jaxsat.errors import InputError
from jaxsat.sweep import Source, SweepPlan, claim, run_dask, run_local
from jaxsat.sweep.plan import CHUNKS


def test_no_more_chunks_at_once_than_workers_and_the_first_alone(sweep, monkeypatch):
    one = sweep(cases=80)
    claim(one.directory, one.plan)
    lock, inside, most, begun, firsts = threading.Lock(), [0], [0], [], []
    run = one.scenario.run

    def watched(seed, cases):
        with lock:
            inside[0] += 1
            most[0] = max(most[0], inside[0])
            begun.append(int(cases[0]))
            firsts.append(inside[0]) if cases[0] == 0 else None
        threading.Event().wait(0.005)
        with lock:
            inside[0] -= 1
        return run(seed, cases)

    object.__setattr__(one.scenario, "run", watched)
    try:
        run_local(one.source, one.plan, one.directory, range(10), on_done=lambda done: None, workers=3)
    finally:
        object.__setattr__(one.scenario, "run", run)
    assert sorted(begun) == list(range(0, 80, 8)) and most[0] <= 3 and begun[0] == 0 and firsts == [1]


def test_an_error_stops_the_sweep_and_is_the_callers(tmp_path):
    source = Source.of("fake_scenario:broken", {})
    plan = SweepPlan("broken", 0, {}, 4, 40)
    claim(tmp_path, plan)
    with pytest.raises(OSError, match="No space left"):
        run_local(source, plan, tmp_path, plan.shard(), on_done=lambda done: None)
    assert list((tmp_path / CHUNKS).glob("*chunk*")) == []


def test_an_interruption_keeps_what_is_whole(sweep):
    # Chunks of some length, so that a thread that has to wait for a processor is not overtaken thrice.
    one, whole = sweep(cases=80, pause_s="0.05"), sweep("whole", cases=80, pause_s="0.05")
    claim(one.directory, one.plan)
    said = []

    def interrupt(done):
        if done.number == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_local(
            one.source,
            one.plan,
            one.directory,
            one.plan.shard(),
            on_done=interrupt,
            on_interrupt=lambda: said.append(1),
            workers=2,
        )
    kept = len(one.chunk_bytes())
    assert said == [1] and 3 <= kept <= 5
    assert len(one.run(resume=True)) == 10 - kept
    whole.run()
    assert one.merged() == whole.merged()


def test_dask_without_dask_is_one_line(sweep, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    one = sweep()
    with pytest.raises(InputError, match=r"engine dask: needs dask.distributed: pip install 'jaxsat\[dask\]'"):
        run_dask(one.source, one.plan, one.directory, [0], on_done=lambda done: None)


@pytest.mark.slow
def test_dask_worker_killed_half_way(sweep):
    """Its chunks are run by others, and the files are those of threads."""
    distributed = pytest.importorskip("distributed")
    one, whole = sweep(cases=160, pause_s="0.02"), sweep("whole", cases=160, pause_s="0")
    claim(one.directory, one.plan)
    done = []
    settings = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 60}
    with distributed.LocalCluster(**settings) as cluster, distributed.Client(cluster) as client:
        victim = min(client.run(os.getpid).values())

        def kill(chunk):
            done.append(chunk.number)
            if len(done) == 5:
                os.kill(victim, signal.SIGKILL)

        run_dask(
            one.source,
            one.plan,
            one.directory,
            one.plan.shard(),
            on_done=kill,
            scheduler=cluster.scheduler_address,
        )
    assert sorted(done) == one.plan.shard()
    whole.run()
    assert [table(one, name) for name in ("case", "miss_deg")] == [table(whole, name) for name in ("case", "miss_deg")]


def table(sweep, name):
    import pyarrow as pa
    import pyarrow.parquet as pq

    sweep.merged()
    with pa.OSFile(str(sweep.directory / "cases.parquet")) as stream:
        return pq.read_table(stream, columns=[name]).column(0).to_pylist()


def test_a_signal_in_a_collection_stops_the_sweep(sweep):
    """Raised there at once it would be dropped."""
    one = sweep(cases=80)
    claim(one.directory, one.plan)

    def landing(phase, info):
        gc.callbacks.remove(landing)
        signal.raise_signal(signal.SIGINT)

    def collect(done):
        if done.number == 2:
            gc.callbacks.append(landing)
            gc.collect()

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        run_local(one.source, one.plan, one.directory, one.plan.shard(), on_done=collect, workers=2)
    assert 3 <= len(one.chunk_bytes()) < 10 and signal.getsignal(signal.SIGINT) is before
