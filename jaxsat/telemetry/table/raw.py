"""A table as it stands in its file: names and cells, CSV or Parquet, before anything is made of them."""

import csv
import difflib
import hashlib
import io
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import read_small_file

MAX_FILE_BYTES = 512 * 2**20
_DELIMITERS = (",", ";", "\t")
Cells = Sequence[str] | np.ndarray
"""Texts of a CSV file; of a Parquet file numbers with NaN where there is none, texts, or instants (datetime64, ns)."""


@dataclass(frozen=True)
class RawTable:
    """A file's columns."""

    path: Path
    sha256: str
    rows: np.ndarray
    """[rows] line in the file from 1, with the header; of a Parquet file the row's number from 1."""
    columns: dict[str, Cells]

    def column(self, name: str, named: Collection[str] = ()) -> Cells:
        """A column by its name; `InputError` with what is like it, and not `named` itself, where there is none."""
        if name not in self.columns:
            close = difflib.get_close_matches(name, [each for each in self.columns if each not in named], n=1)
            known = ", ".join(list(self.columns)[:12]) + (", ..." if len(self.columns) > 12 else "")
            hint = f"did you mean {close[0]!r}?" if close else f"there are {known}"
            raise InputError(f"no such column; {hint}", file=self.path, field=name)
        return self.columns[name]


def read_raw_table(path: str | Path) -> RawTable:
    """Returns the columns of a CSV or a Parquet file, told by its first bytes.

    CSV is UTF-8 with one header, cells apart by comma, semicolon or tab, quoted or not; blank lines and lines that
    begin with # are passed over. Raises `InputError` with file and row for anything else: no file, too long, a column
    twice or without a name, a row of another length, no row at all.
    """
    path = Path(path)
    if _is_parquet(path):
        return _read_parquet(path)
    data = read_small_file(path, limit_bytes=MAX_FILE_BYTES, kind="CSV or Parquet")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise InputError(f"byte 0x{data[error.start]:02x} is not UTF-8 text", file=path, row=row) from None
    lines, names, cells = _csv_rows(text, path)
    columns = list(zip(*cells, strict=True))
    if not columns:
        raise InputError("holds no row below its header", file=path)
    sha256 = hashlib.sha256(data).hexdigest()
    return RawTable(path, sha256, np.array(lines), dict(zip(names, columns, strict=True)))


def _csv_rows(text: str, path: Path) -> tuple[list[int], list[str], list[list[str]]]:
    """Line numbers, names, and the cells of each row."""
    header, lines, rows = [], [], []
    delimiter = _delimiter(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        for cells in reader:
            if not cells or (len(cells) == 1 and not cells[0].strip()) or cells[0].lstrip().startswith("#"):
                continue
            line = reader.line_num
            if not header:
                header = _names(cells, path, line)
            elif len(cells) != len(header):
                reason = f"expected {len(header)} cells as in the header, found {len(cells)}"
                if delimiter == "," and len(cells) > len(header):
                    reason += "; a decimal comma wants ; between cells, and is not read: write a point"
                raise InputError(reason, file=path, row=line)
            else:
                lines.append(line)
                rows.append([cell.strip() for cell in cells])
    except csv.Error as error:
        raise InputError(f"damaged CSV: {error}", file=path, row=reader.line_num) from None
    if not header:
        raise InputError("holds no header", file=path)
    return lines, header, rows


def _delimiter(text: str) -> str:
    for line in io.StringIO(text):
        if line.strip() and not line.lstrip().startswith("#"):
            return max(_DELIMITERS, key=line.count)
    return ","


def _names(cells: list[str], path: Path, line: int) -> list[str]:
    names = [cell.strip() for cell in cells]
    for number, name in enumerate(names, 1):
        if not name:
            raise InputError(f"column {number} has no name", file=path, row=line)
        if name in names[: number - 1]:
            raise InputError(f"expected each column once, found {name!r} again", file=path, row=line, field=name)
    return names


def _is_parquet(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(4) == b"PAR1"
    except OSError:
        # What is wrong with it is told by the reading.
        return False


def _read_parquet(path: Path) -> RawTable:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"damaged Parquet: {str(error).splitlines()[0]}", file=path) from None
    if not table.num_rows:
        raise InputError("holds no row", file=path)
    columns: dict[str, Cells] = {}
    for name in table.column_names:
        if name in columns:
            raise InputError(f"expected each column once, found {name!r} again", file=path, field=name)
        columns[name] = _arrow_cells(table.column(name))
    with path.open("rb") as stream:
        sha256 = hashlib.file_digest(stream, "sha256").hexdigest()
    return RawTable(path, sha256, np.arange(1, table.num_rows + 1), columns)


def _arrow_cells(column) -> Cells:
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind):
        cells = column.cast(pa.timestamp("ns", tz=kind.tz)).to_numpy().astype("datetime64[ns]")
        # A stamp with a time zone is UTC inside; one without is told apart by its text.
        return cells if kind.tz else [("" if np.isnat(cell) else str(cell)) for cell in cells]
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind) or pa.types.is_null(kind):
        return column.cast(pa.float64()).to_numpy().astype(float)
    return ["" if value is None else str(value) for value in column.to_pylist()]
