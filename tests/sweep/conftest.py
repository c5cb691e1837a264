"""A sweep of the scenario without physics, run in this process."""

from pathlib import Path

import pytest

from jaxsat.sweep import Source, SweepPlan, claim, find_missing, merge_cases, run_local


class Sweep:
    """Settings of a sweep, and what is done with it in a directory."""

    def __init__(self, directory: Path, cases: int = 37, seed: int = 3, **options: str):
        self.directory, self.source = directory, Source.of("fake_scenario:make", options)
        self.scenario = self.source.scenario()
        self.plan = SweepPlan("fake", seed, dict(self.source.options), self.scenario.chunk, cases)

    def run(self, *, resume: bool = False, shard: tuple[int, int] = (1, 1)) -> list[int]:
        """Claims the directory and runs what is missing; returns the chunks that were run."""
        claim(self.directory, self.plan, resume=resume, shard=shard)
        missing, _ = find_missing(self.scenario, self.plan, self.directory, self.plan.shard(*shard))
        ran = []
        run_local(self.source, self.plan, self.directory, missing, on_done=lambda done: ran.append(done.number))
        return sorted(ran)

    def merged(self) -> bytes:
        """cases.parquet."""
        merge_cases(self.scenario, self.plan, self.directory)
        return (self.directory / "cases.parquet").read_bytes()

    def chunk_bytes(self) -> list[bytes]:
        """All chunk files in order."""
        return [path.read_bytes() for path in sorted((self.directory / "chunks").glob("*.parquet"))]


@pytest.fixture
def sweep(tmp_path):
    """Makes a `Sweep` in a directory of the given name."""

    def make(name: str = "sweep", **settings) -> Sweep:
        return Sweep(tmp_path / name, **settings)

    return make
