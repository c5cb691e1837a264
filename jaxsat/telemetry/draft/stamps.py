"""The column of stamps in a table, and its form."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jaxsat.errors import InputError
from jaxsat.telemetry.table.cells import numbers
from jaxsat.telemetry.table.raw import RawTable

_NAMES = (
    r"utc",
    r"unix",
    r"time.?stamp|datetime|date.?time|date/time",
    r"^time",
    r"epoch|stamp|^t_|_t$|time|date",
    r"^t$",
)
_ISO = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}[T ][0-9]{2}:[0-9]{2}:.*")
_ZONE = re.compile(r".*(?:Z|[+-][0-9]{2}:?[0-9]{2})")
_UNIX = ((3e8, 5e9, "s"), (3e11, 5e12, "ms"), (3e14, 5e15, "us"), (3e17, 5e18, "ns"))


@dataclass(frozen=True)
class StampGuess:
    """The stamps of a table."""

    column: str
    form: str
    unit: str = "s"
    zone_missing: bool = False


def guessed_stamps(table: RawTable) -> StampGuess:
    """Returns the column of stamps and its form; `InputError` where no column is like one."""
    for pattern in _NAMES:
        for name in table.columns:
            if re.search(pattern, name, re.IGNORECASE) and (found := _form(table, name)):
                return found
    # By the contents alone.
    for name in table.columns:
        found = _form(table, name)
        if found and found.form != "seconds":
            return found
    raise InputError("has no column of stamps that could be told", file=table.path)


def _form(table: RawTable, name: str) -> StampGuess | None:
    cells = table.columns[name]
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        return StampGuess(name, "iso")
    if not isinstance(cells, np.ndarray):
        filled = [cell for cell in cells if cell]
        if filled and all(_ISO.fullmatch(cell) for cell in filled):
            return StampGuess(name, "iso", zone_missing=not all(_ZONE.fullmatch(cell[10:]) for cell in filled))
    values = _numbers(table, name)
    if values is None or values.size < 2 or np.mean(np.diff(values) >= 0.0) < 0.9 or np.ptp(values) == 0.0:
        return None
    unit = next((unit for low, high, unit in _UNIX if low < values.min() and values.max() < high), None)
    return StampGuess(name, "unix", unit) if unit else StampGuess(name, "seconds")


def _numbers(table: RawTable, name: str, not_measured: Sequence[str] = ()) -> np.ndarray | None:
    try:
        values = numbers(table, name, not_measured)
    except InputError:
        return None
    return values[np.isfinite(values)]
