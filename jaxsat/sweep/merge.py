"""From the chunks of a finished sweep to one table."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from jaxsat.errors import InputError
from jaxsat.files.whole_file import write_whole
from jaxsat.sweep.chunks import chunk_path, device_of, number_fields, read_chunk
from jaxsat.sweep.plan import SweepPlan
from jaxsat.sweep.scenario import Scenario

CASES = "cases.parquet"
ROW_GROUP = 2**16
"""Rows of a row group: chunks are small, and a reader pays for each group."""


def merge_cases(
    scenario: Scenario, plan: SweepPlan, directory: Path, *, devices: Counter[str] | None = None
) -> np.ndarray:
    """Writes DIR/cases.parquet from all chunks, a row group at a time, and returns the status numbers [cases, int8].

    Its bytes depend on the sweep alone, so that two processes may do this at once. `devices` counts the chunks of each
    device that has run some. Raises `InputError` for a chunk that is absent or no good.
    """
    status = np.empty(plan.cases, np.int8)
    schema = pa.schema(
        [
            pa.field("case", pa.int64()),
            pa.field("status", pa.dictionary(pa.int8(), pa.string())),
            *number_fields(scenario),
        ]
    )

    settings: dict[str, Any] = {"write_page_checksum": True, "use_dictionary": ["status"]}

    def write(stream):
        with pq.ParquetWriter(stream, schema, **settings) as writer:
            begin = 0
            for table in _groups(scenario, plan, directory, Counter() if devices is None else devices):
                codes = table.column("status").to_numpy()
                status[begin : begin + len(codes)] = codes
                begin += len(codes)
                named = pa.DictionaryArray.from_arrays(pa.array(codes), pa.array(scenario.statuses))
                numbers = (*scenario.metrics, *scenario.input_columns)
                columns = [table.column("case"), named, *(table.column(name) for name in numbers)]
                writer.write_table(pa.Table.from_arrays(columns, schema=schema), row_group_size=ROW_GROUP)

    write_whole(directory / CASES, write)
    return status


def _groups(scenario: Scenario, plan: SweepPlan, directory: Path, devices: Counter[str]) -> Iterator[pa.Table]:
    """All chunks in order, as tables of `ROW_GROUP` rows."""
    rest: list[pa.Table] = []
    rows = 0
    for number in range(plan.chunks):
        try:
            rest.append(read_chunk(scenario, plan, directory, number))
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"{error}; --resume runs it again", file=chunk_path(directory, number)) from None
        devices[device_of(rest[-1])] += 1
        # What is said of a chunk is no part of the table.
        rest[-1] = rest[-1].replace_schema_metadata()
        rows += rest[-1].num_rows
        while rows >= ROW_GROUP:
            table = pa.concat_tables(rest)
            yield table.slice(0, ROW_GROUP)
            rest, rows = [table.slice(ROW_GROUP)], rows - ROW_GROUP
    if rows:
        yield pa.concat_tables(rest)


def read_metric(directory: Path, name: str) -> np.ndarray:
    """One metric of all cases [cases] from DIR/cases.parquet; NaN where a case does not have it."""
    with (directory / CASES).open("rb") as stream:
        return pq.ParquetFile(stream).read(columns=[name]).column(0).to_numpy()
