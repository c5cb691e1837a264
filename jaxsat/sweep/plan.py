"""What makes a sweep this sweep, and the directory that it owns."""

import dataclasses
import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from jaxsat.errors import InputError
from jaxsat.files.json_files import read_json
from jaxsat.files.publishing import refuse_folders
from jaxsat.files.toml_files import validated
from jaxsat.files.whole_file import locked, remove_leftovers, write_whole
from jaxsat.numerics import Precision
from jaxsat.setting_types import Section

SCHEMA = "jaxsat.sweep-plan/1"
_LIMIT_BYTES = 2**20
_KEYS = 2**32
"""Seeds and case numbers that random keys tell apart."""
PLAN, CHUNKS = "sweep.json", "chunks"
LOCK = f"{CHUNKS}/.lock"
MERGED = ("cases.parquet", "distributions.png", "sweep.html", "summary.json")
"""What merging writes, the last one last."""


@dataclass(frozen=True)
class SweepPlan:
    """All that the numbers of a sweep depend on, and how many cases it has."""

    scenario: str
    seed: int
    options: dict[str, str]
    """Every option of the scenario."""
    chunk: int
    """Cases of a chunk."""
    cases: int
    """Case numbers are 0 to `cases` - 1; a case is the same whatever their number."""
    versions: dict[str, str] = field(default_factory=dict, compare=False)
    """Of the software that began the sweep: provenance, no part of its identity."""
    code: str = ""
    """SHA-256 of the file of a scenario of the user's own; empty for those of jaxsat."""
    precision: Precision = "float64"
    """Of all its numbers."""

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return math.ceil(self.cases / self.chunk)

    def rows(self, number: int) -> int:
        """Cases of a chunk that are kept: all, but for the last chunk."""
        return min(self.chunk, self.cases - number * self.chunk)

    def case_numbers(self, number: int) -> np.ndarray:
        """Numbers of the cases of a chunk, always `chunk` of them: the last chunk is run beyond its end and cut."""
        # With the numbers that would follow, so that a chunk is one and the same whatever the number of cases.
        return np.arange(number * self.chunk, (number + 1) * self.chunk, dtype=np.int64)

    def shard(self, part: int = 1, parts: int = 1) -> list[int]:
        """Numbers of the chunks of one of `parts` shards, counted from 1."""
        return list(range(part - 1, self.chunks, parts))

    def identity(self) -> dict[str, Any]:
        """What must agree where two runs share a directory."""
        own = {"code": self.code} if self.code else {}
        if self.precision != "float64":
            own["precision"] = self.precision
        return {"scenario": self.scenario, "seed": self.seed, "options": self.options, "chunk": self.chunk, **own}

    def difference(self, other: "SweepPlan") -> str:
        """The first thing in which the identity of `other` is not this one's, as `seed 1, not 2`; empty if none."""
        for key in ("scenario", "seed", "options", "chunk"):
            own, asked = self.identity()[key], other.identity()[key]
            if key == "options" and own != asked:
                for name in dict.fromkeys([*own, *asked]):
                    if own.get(name) != asked.get(name):
                        return f"option {name} = {own.get(name, 'absent')}, not {asked.get(name, 'absent')}"
            if own != asked:
                return f"{key.replace('chunk', 'cases of a chunk')} {own}, not {asked}"
        if self.precision != other.precision:
            return f"precision {self.precision}, not {other.precision}"
        if self.code != other.code:
            return "other code of its scenario, whose file has changed since"
        return ""


class _Stored(Section):
    """The file sweep.json."""

    schema_: Literal["jaxsat.sweep-plan/1"] = Field(alias="schema")
    scenario: str = Field(min_length=1)
    seed: int = Field(ge=0, lt=_KEYS)
    options: dict[str, str]
    chunk: int = Field(ge=1, le=_KEYS)
    cases: int = Field(ge=1, le=_KEYS)
    versions: dict[str, str] = {}
    code: str = ""
    precision: Precision = "float64"


def read_plan(directory: Path) -> SweepPlan | None:
    """The plan of the sweep that a directory holds, None where it holds none; `InputError` for one out of order."""
    path = directory / PLAN
    if not os.path.lexists(path):
        return None
    try:
        document = read_json(path, limit_bytes=_LIMIT_BYTES, kind="plan of a sweep")
        return SweepPlan(**validated(_Stored, document).model_dump(exclude={"schema_"}))
    except InputError as error:
        reason = error.reason if error.field is None else f"{error.field}: {error.reason}"
        raise InputError(f"is no plan of a sweep ({SCHEMA}): {reason}; take another directory", file=path) from None


def claim(directory: Path, plan: SweepPlan, *, resume: bool = False, shard: tuple[int, int] = (1, 1)) -> SweepPlan:
    """Makes `directory` that of this sweep, or of this shard of it, and returns the plan with which the sweep began.

    Raises `InputError` where it holds another sweep or fewer cases are asked for than it has, and, but with `resume`,
    where chunks are there already. With `resume` a sweep may grow. Two shards may begin at the same moment.
    """
    if directory.exists() and not directory.is_dir():
        raise InputError("is a file; expected a directory for the results", file=directory)
    refuse_folders(directory, (PLAN, *MERGED))
    try:
        (directory / CHUNKS).mkdir(parents=True, exist_ok=True)
        with locked(directory / LOCK):
            return _claim(directory, plan, resume, shard)
    except OSError as error:
        raise InputError(f"cannot write results here: {error.strerror or error}", file=directory) from None


def _claim(directory: Path, plan: SweepPlan, resume: bool, shard: tuple[int, int]) -> SweepPlan:
    found = read_plan(directory)
    # A first run that ended in an error of the user's own code has left nothing that a mended one could spoil.
    unused = found is not None and found.code and shard[1] == 1 and not any((directory / CHUNKS).glob("chunk-*"))
    if found is None or unused:
        found = plan
        _write(directory, plan)
    elif not resume and (shard[1] == 1 or _has_chunks(directory, plan.shard(*shard))):
        raise InputError("holds a sweep already; --resume finishes it, --out begins another elsewhere", file=directory)
    difference = found.difference(plan)
    if not difference and (plan.cases < found.cases or (plan.cases > found.cases and not resume)):
        difference = f"{found.cases} cases, not {plan.cases}"
    if difference:
        raise InputError(f"holds a sweep with {difference}; take another --out", file=directory)
    remove_leftovers(directory, (PLAN, *MERGED))
    remove_leftovers(directory / CHUNKS, {chunk_name(number) for number in plan.shard(*shard)})
    if plan.cases > found.cases:
        for name in reversed(MERGED):
            (directory / name).unlink(missing_ok=True)
        if found.cases % found.chunk:
            # Cut at the old end.
            (directory / CHUNKS / chunk_name(found.chunks - 1)).unlink(missing_ok=True)
        _write(directory, dataclasses.replace(plan, versions=found.versions))
    return found


def chunk_name(number: int) -> str:
    """Name of the file of a chunk."""
    return f"chunk-{number:08d}.parquet"


def _has_chunks(directory: Path, numbers: list[int]) -> bool:
    return any((directory / CHUNKS / chunk_name(number)).exists() for number in numbers)


def _write(directory: Path, plan: SweepPlan) -> None:
    stored = dataclasses.asdict(plan)
    if not plan.code:
        del stored["code"]
    if plan.precision == "float64":
        del stored["precision"]
    text = json.dumps({"schema": SCHEMA, **stored}, indent=2, ensure_ascii=False) + "\n"
    write_whole(directory / PLAN, lambda stream: stream.write(text.encode()))
