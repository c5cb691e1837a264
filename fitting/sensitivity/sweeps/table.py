"""What a finished sweep keeps, as its sensitivity needs it: inputs with all of their columns, and metrics."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from jaxsat.errors import InputError
from jaxsat.files.json_files import read_json
from jaxsat.sweep import read_plan
from jaxsat.sweep.inputs import PREFIX
from jaxsat.sweep.merge import CASES
from jaxsat.sweep.plan import PLAN
from jaxsat.sweep.scenario import as_numbers
from jaxsat.sweep.summary import SCHEMA

SUCCESS = "success"
"""Name of the metric that is 1 for a case that succeeded and 0 for one that did not."""
_SUMMARY = "summary.json"
_LIMIT_BYTES = 2**30


@dataclass(frozen=True)
class Column:
    """Numbers of all cases, in one column or a few that are one input."""

    values: np.ndarray
    """[cases], or [cases columns] of an input."""
    unit: str
    meaning: str
    columns: tuple[str, ...] = ()
    """Names of an input's columns."""


@dataclass(frozen=True)
class SweepTable:
    """A finished sweep."""

    directory: Path
    scenario: str
    seed: int
    options: dict[str, int | float | str]
    cases: int
    failed: int
    inputs: dict[str, Column]
    metrics: dict[str, Column]
    """`success` is the first of them; a metric that a case does not have is NaN."""


def holds_sweep(directory: Path) -> bool:
    """Whether a directory is that of a sweep, finished or not."""
    return (directory / PLAN).is_file() or (directory / CASES).is_file()


def read_sweep(directory: Path) -> SweepTable:
    """What `jaxsat sweep` left in a directory; `InputError` where it is no sweep, not finished, or keeps no inputs."""
    plan = read_plan(directory) if directory.is_dir() else None
    if plan is None:
        raise InputError("holds no sweep (`jaxsat sweep SCENARIO --out DIR` makes one)", file=directory)
    again = f"jaxsat sweep {plan.scenario} --out {directory} --resume"
    for name in (CASES, _SUMMARY):
        if not (directory / name).exists():
            raise InputError(f"is not there, so the sweep is not finished; `{again}` does that", file=directory / name)
    summary = read_json(directory / _SUMMARY, limit_bytes=_LIMIT_BYTES, kind="summary of a sweep")
    statuses = summary.get("statuses")
    if summary.get("schema") != SCHEMA or not isinstance(statuses, dict) or not statuses:
        raise InputError(f"is no summary of a sweep ({SCHEMA}) with its statuses", file=directory / _SUMMARY)
    table = _read(directory / CASES)
    metrics, inputs = _columns(table, directory / CASES)
    if not inputs:
        reason = f"has no columns {PREFIX}..., what each case was drawn from; `{again}` adds what the scenario says"
        raise InputError(reason, file=directory / CASES)
    success = np.array([status == next(iter(statuses)) for status in table.column("status").to_pylist()], float)
    metrics = {SUCCESS: Column(success, "1", "1 where a case succeeded, 0 where it did not"), **metrics}
    return SweepTable(
        directory,
        plan.scenario,
        plan.seed,
        as_numbers(plan.options),
        table.num_rows,
        int(np.sum(success == 0.0)),
        inputs,
        metrics,
    )


def regrouped(table: SweepTable, together: Sequence[Sequence[str]], apart: Sequence[str] = ()) -> SweepTable:
    """The same with some inputs as one, `a+b` of a and b, and with the columns of some as inputs of their own.

    Raises `InputError` for a name that is none, or is given twice.
    """
    inputs = dict(table.inputs)

    def taken(name: str) -> Column:
        if name not in inputs:
            known = f"inputs are {', '.join(table.inputs)}"
            raise InputError(f"no such input of this sweep, or named twice; {known}", field=name)
        return inputs.pop(name)

    for name in apart:
        whole = taken(name)
        for k, column in enumerate(whole.columns):
            inputs[column.removeprefix(PREFIX)] = replace(whole, values=whole.values[:, k : k + 1], columns=(column,))
    for names in together:
        parts = [taken(name) for name in names]
        inputs["+".join(names)] = Column(
            np.concatenate([part.values for part in parts], axis=1),
            ", ".join(dict.fromkeys(part.unit for part in parts)),
            "; ".join(part.meaning for part in parts),
            tuple(column for part in parts for column in part.columns),
        )
    return replace(table, inputs=inputs)


def _read(path: Path) -> pa.Table:
    if not path.is_file():
        raise InputError("is no file", file=path)
    try:
        with path.open("rb") as stream:
            table = pq.ParquetFile(stream, page_checksum_verification=True).read(use_threads=False)
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read: {' '.join(str(error).split())}; merging again mends it", file=path) from None
    if "status" not in table.column_names or table.num_rows == 0:
        raise InputError("is no table of cases: expected a column status, and rows", file=path)
    return table


def _columns(table: pa.Table, path: Path) -> tuple[dict[str, Column], dict[str, Column]]:
    """Metrics and inputs by their names."""
    metrics: dict[str, Column] = {}
    parts: dict[str, list[str]] = {}
    for name in table.column_names:
        if name in ("case", "status"):
            continue
        if not pa.types.is_floating(table.schema.field(name).type):
            raise InputError(f"expected numbers, found {table.schema.field(name).type}", file=path, field=name)
        if name.startswith(PREFIX):
            # Columns of a table by other hands say of no input whose they are.
            parts.setdefault(_said(table, name, "input") or name.removeprefix(PREFIX), []).append(name)
        else:
            metrics[name] = Column(_numbers(table, name), _said(table, name, "unit"), _said(table, name, "meaning"))
    inputs = {}
    for own, names in parts.items():
        values = np.stack([_numbers(table, name) for name in names], axis=1)
        bad = np.argwhere(~np.isfinite(values))
        if len(bad):
            raise InputError("is not finite", file=path, row=int(bad[0][0]) + 1, field=names[bad[0][1]])
        inputs[own] = Column(values, _said(table, names[0], "unit"), _said(table, names[0], "meaning"), tuple(names))
    return metrics, inputs


def _numbers(table: pa.Table, name: str) -> np.ndarray:
    return np.asarray(table.column(name).to_numpy(), float)


def _said(table: pa.Table, name: str, key: str) -> str:
    found = (table.schema.field(name).metadata or {}).get(key.encode(), b"")
    return found.decode("utf-8", "replace")
