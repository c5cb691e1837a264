"""Runs what is missing of a sweep, or of a shard of it, and writes the results when nothing is."""

import functools
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.cli.shared.talk import Talk
from jaxsat.cli.sweep.files import COMPARED, finish, sweep_summary
from jaxsat.cli.sweep.progress import SweepProgress
from jaxsat.significant import count_text
from jaxsat.sweep import (
    ChunkDone,
    Scenario,
    Source,
    SweepPlan,
    chunk_path,
    claim,
    find_missing,
    read_plan,
    run_dask,
    run_local,
)
from jaxsat.sweep.chunks import count_absent
from jaxsat.sweep.merge import read_metric
from jaxsat.sweep.precision.agreement import agreement, in_double


@dataclass(frozen=True)
class SweepRun:
    """A sweep, or a shard of one, as it is to be run."""

    source: Source
    scenario: Scenario
    plan: SweepPlan
    out: Path
    shard: tuple[int, int]
    engine: str
    workers: int | None
    scheduler: str | None
    resuming: str
    """The command that finishes it."""
    replaying: tuple[str, ...]
    """Words of the command that shows a case, whose number comes behind."""

    def carry_out(self, *, resume: bool, imported: float, began: float, plots: bool, talk: Talk) -> int:
        """Runs what is missing, and merges and tells where that was the last."""
        done = self.complete(resume=resume, imported=imported, began=began, plots=plots, talk=talk)
        if done is not None:
            compared = done[0].get(COMPARED)
            if compared is not None and not compared["holds"] and (talk.quiet or talk.json):
                print(f"jaxsat: warning: {compared['message']}", file=sys.stderr)
            summary = sweep_summary(*done, whole=talk.verbose)
            talk.result(summary, f"\nresults in {self.out}", document=self.out / "summary.json")
        return 0

    def complete(
        self, *, resume: bool, imported: float, began: float, plots: bool, talk: Talk
    ) -> tuple[dict[str, Any], np.ndarray] | None:
        """Runs what is missing; the summary's content and the status numbers [cases], None where some is still so."""
        if resume and read_plan(self.out) is None:
            talk.note(f"{self.out} holds no sweep yet: beginning it")
        begun = claim(self.out, self.plan, resume=resume, shard=self.shard)
        other = [f"{name} {old}" for name, old in begun.versions.items() if self.plan.versions.get(name) != old]
        if other:
            print(f"jaxsat: warning: begun with {', '.join(other)}: last digits may differ", file=sys.stderr)
        own = self.plan.shard(*self.shard)
        begin = time.perf_counter()
        missing, rejected = find_missing(self.scenario, self.plan, self.out, own)
        for path, reason in rejected:
            print(f"jaxsat: warning: {path}: {reason}; it is run again", file=sys.stderr)
        if len(missing) < len(own):
            talk.note(f"{len(own) - len(missing)} of {len(own)} chunks are there already")
        timing = {"import": imported, "verify": time.perf_counter() - begin}
        ran, timing_of_run = self._run(missing, talk)
        timing = {**timing, **timing_of_run}

        absent = count_absent(self.plan, self.out)
        if absent:
            missing_still = f"{self.plan.scenario}: {absent} of {self.plan.chunks} chunks are still missing"
            talk.note(f"{missing_still}: other shards have to run, or one run of all: {self.resuming}")
            return None
        return finish(
            self.scenario,
            self.plan,
            self.out,
            ran=ran,
            timing=timing,
            began=began,
            plots=plots,
            replay=self.replaying,
            compare=None if self.plan.precision == "float64" else functools.partial(self._compare, talk),
        )

    def _compare(self, talk: Talk, status: np.ndarray) -> dict[str, Any]:
        """What single precision does to the sweep's first cases; `status` is that of all."""
        # The scenario's own chunk: the very numbers of a sweep in double precision.
        own = replace(self.source, chunk=0).scenario().chunk
        first = min(own, self.plan.cases)
        with talk.stages(f"{self.plan.scenario}, {count_text(first, 'case')}") as progress:
            progress("in double precision too")
            double = in_double(self.source, self.plan.seed, np.arange(own))
        single = {name: read_metric(self.out, name)[:first] for name in self.scenario.metrics}
        double = {name: values[:first] for name, values in double.items()}
        return agreement(self.scenario.metrics, double, {"status": status[:first], **single})

    def _run(self, missing: list[int], talk: Talk) -> tuple[int, dict[str, float]]:
        """Runs chunks; returns the number of their cases and how long the first one and all of them took [s]."""
        cases = sum(self.plan.rows(number) for number in missing)
        begin, first = time.perf_counter(), []
        try:
            with SweepProgress(self.plan.scenario, cases, quiet=talk.quiet) as progress:

                def on_done(done: ChunkDone) -> None:
                    if not first:
                        first.append(time.perf_counter() - begin)
                    progress(done.cases, done.failed)

                common = {"on_done": on_done, "workers": self.workers}
                if self.engine == "dask":
                    run_dask(self.source, self.plan, self.out, missing, scheduler=self.scheduler, **common)
                else:
                    run_local(self.source, self.plan, self.out, missing, on_interrupt=_say_waiting, **common)
        except (KeyboardInterrupt, SystemExit) as stop:
            message = self._stopped(missing)
            if isinstance(stop, KeyboardInterrupt):
                raise KeyboardInterrupt(message) from None
            print(f"jaxsat: {message}", file=sys.stderr)
            raise
        return cases, {"first_chunk": sum(first, 0.0), "run": time.perf_counter() - begin}

    def _stopped(self, missing: list[int]) -> str:
        own = self.plan.shard(*self.shard)
        left = sum(not chunk_path(self.out, number).exists() for number in missing)
        shard = "" if self.shard[1] == 1 else f" --shard {self.shard[0]}/{self.shard[1]}"
        kept = f"{len(own) - left} of {len(own)} chunks are kept"
        return f"interrupted; {kept}; resume with: {self.resuming}{shard}"


def _say_waiting() -> None:
    print("\njaxsat: finishing the chunks under way", file=sys.stderr, flush=True)
