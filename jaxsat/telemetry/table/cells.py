"""Cells of a table as numbers: plain decimal numbers alone, an empty cell is not measured."""

from collections.abc import Sequence

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL
from jaxsat.telemetry.table.raw import RawTable


def numbers(table: RawTable, name: str, not_measured: Sequence[str] = ()) -> np.ndarray:
    """Returns a column as numbers [rows], NaN where nothing is measured.

    Raises `InputError` with row and column for what is no plain finite number, such as nan, inf, 1_0 or 1,5.
    """
    cells = table.column(name)
    if isinstance(cells, np.ndarray):
        if cells.dtype.kind == "M":
            raise InputError("expected numbers, found instants", file=table.path, field=name)
        bad = np.flatnonzero(np.isinf(cells))
        if bad.size:
            raise _refusal(table, name, int(bad[0]), str(cells[bad[0]]))
        return cells
    empty = {"", *not_measured}
    values = np.full(len(cells), np.nan)
    for place, cell in enumerate(cells):
        if cell in empty:
            continue
        if not REAL.fullmatch(cell):
            raise _refusal(table, name, place, cell)
        values[place] = float(cell)
    beyond = np.flatnonzero(np.isinf(values))
    if beyond.size:
        raise _refusal(table, name, int(beyond[0]), cells[int(beyond[0])])
    return values


def _refusal(table: RawTable, name: str, place: int, cell: str) -> InputError:
    shown = repr(cell if len(cell) <= 40 else cell[:40] + "...")
    reason = f"expected a plain finite decimal number, or an empty cell where it is not measured, found {shown}"
    if cell.lower() in ("nan", "null", "none", "na", "n/a", "-", "nat"):
        reason += f'; write rows.not_measured = ["{cell}"] if that means not measured'
    return InputError(reason, file=table.path, row=int(table.rows[place]), field=name)
