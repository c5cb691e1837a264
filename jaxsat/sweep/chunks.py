"""Chunks of a sweep: each a Parquet file that is whole or absent, and that says of which sweep it is."""

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from jaxsat.errors import InputError
from jaxsat.files.publishing import refuse_folders
from jaxsat.files.whole_file import write_whole
from jaxsat.numerics import device_name
from jaxsat.sweep.plan import CHUNKS, SweepPlan, chunk_name
from jaxsat.sweep.scenario import Scenario, drawn_inputs, run_cases

_IDENTITY, _DEVICE = b"jaxsat.sweep", b"jaxsat.device"


@dataclass(frozen=True)
class ChunkDone:
    """What became of a chunk."""

    number: int
    cases: int
    failed: int


def chunk_path(directory: Path, number: int) -> Path:
    """The file of a chunk of the sweep in a directory."""
    return directory / CHUNKS / chunk_name(number)


def number_fields(scenario: Scenario) -> list[pa.Field]:
    """Columns of metrics and of inputs, each with its unit and meaning; columns of one input say its name too."""
    metrics = [
        pa.field(name, pa.float64(), metadata={"unit": metric.unit, "meaning": metric.meaning})
        for name, metric in scenario.metrics.items()
    ]
    inputs = [
        pa.field(name, pa.float64(), metadata={"unit": one.unit, "meaning": one.meaning, "input": one.name})
        for one in scenario.inputs
        for name in one.columns
    ]
    return metrics + inputs


def chunk_schema(plan: SweepPlan, scenario: Scenario) -> pa.Schema:
    """Columns of a chunk's file: case, the number of the status, metrics, inputs; with the sweep's identity."""
    identity = {**plan.identity(), "statuses": list(scenario.statuses)}
    fields = [pa.field("case", pa.int64()), pa.field("status", pa.int8()), *number_fields(scenario)]
    return pa.schema(fields, metadata={_IDENTITY: json.dumps(identity)})


def run_chunk(scenario: Scenario, plan: SweepPlan, directory: Path, number: int) -> ChunkDone:
    """Runs a chunk and writes its file."""
    cases, rows = plan.case_numbers(number), plan.rows(number)
    found = run_cases(scenario, plan.seed, cases)
    found |= drawn_inputs(scenario, plan.seed, cases)
    columns = [cases[:rows], *(found[name][:rows] for name in ("status", *scenario.metrics, *scenario.input_columns))]
    schema = chunk_schema(plan, scenario)
    # Beside the identity: a sweep may be finished on another device.
    schema = schema.with_metadata({**schema.metadata, _DEVICE: device_name()})
    table = pa.Table.from_arrays([pa.array(column) for column in columns], schema=schema)
    # With checksums: what a disk spoils later is found when the sweep is resumed or merged.
    path = chunk_path(directory, number)
    write_whole(path, lambda stream: pq.write_table(table, stream, write_page_checksum=True, use_dictionary=False))
    return ChunkDone(number, rows, int(np.count_nonzero(found["status"][:rows])))


def read_chunk(scenario: Scenario, plan: SweepPlan, directory: Path, number: int) -> pa.Table:
    """Contents of a chunk's file; ValueError with the reason where it is not the chunk of this sweep.

    Raises `InputError` for a folder in its place, or a pipe, which would be waited for.
    """
    refuse_folders(directory / CHUNKS, [chunk_name(number)])
    try:
        # Opened here: a Parquet reader that fails on a path may leave the file open.
        with chunk_path(directory, number).open("rb") as stream:
            table = pq.ParquetFile(stream, page_checksum_verification=True).read(use_threads=False)
    except (OSError, pa.ArrowException, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else " ".join(str(error).split())
        raise ValueError(f"cannot be read: {reason}") from None
    said = {key: text for key, text in (table.schema.metadata or {}).items() if key != _DEVICE}
    if not table.schema.with_metadata(said).equals(chunk_schema(plan, scenario), check_metadata=True):
        raise ValueError("is of another sweep, or has other columns")
    rows = plan.rows(number)
    if table.num_rows != rows:
        raise ValueError(f"has {table.num_rows} rows, expected {rows}")
    if not np.array_equal(table.column("case").to_numpy(), plan.case_numbers(number)[:rows]):
        raise ValueError("has other case numbers")
    status = table.column("status").to_numpy()
    if status.min() < 0 or status.max() >= len(scenario.statuses):
        raise ValueError("has an unknown status")
    return table


def device_of(chunk: pa.Table) -> str:
    """On which device a chunk was run, as `jaxsat.numerics.device_name` says; empty where its file does not."""
    return (chunk.schema.metadata or {}).get(_DEVICE, b"").decode()


def find_missing(
    scenario: Scenario, plan: SweepPlan, directory: Path, numbers: Iterable[int]
) -> tuple[list[int], list[tuple[Path, str]]]:
    """Which of the chunks have to be run, and the files among them that are there but no good, with the reason."""
    missing, rejected = [], []
    for number in numbers:
        path = chunk_path(directory, number)
        if not os.path.lexists(path):
            missing.append(number)
            continue
        try:
            read_chunk(scenario, plan, directory, number)
        except InputError:
            raise
        except ValueError as error:
            missing.append(number)
            rejected.append((path, str(error)))
    return missing, rejected


def count_absent(plan: SweepPlan, directory: Path) -> int:
    """How many chunks of the whole sweep have no file yet."""
    there = {entry.name for entry in (directory / CHUNKS).glob("chunk-*.parquet")}
    return sum(chunk_name(number) not in there for number in range(plan.chunks))
