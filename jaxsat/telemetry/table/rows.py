"""Rows of one or several tables: their numbers, their stamps, and which of them count."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jaxsat.files.conditions import Condition
from jaxsat.satellites.satellite import Satellite
from jaxsat.telemetry.table.cells import numbers
from jaxsat.telemetry.table.raw import RawTable
from jaxsat.telemetry.table.session import RejectedRow
from jaxsat.telemetry.table.stamps import instants

NO_STAMP = "no stamp"


@dataclass(frozen=True)
class Rows:
    """Rows of all files behind each other."""

    files: tuple[RawTable, ...]
    file: np.ndarray
    """[rows] which of the files."""
    row: np.ndarray
    """[rows] line in it."""
    tai: tuple[np.ndarray, np.ndarray]
    columns: dict[str, np.ndarray]
    """Numbers by column, as in the table; NaN where not measured or not in that file."""
    texts: dict[str, np.ndarray]
    """Texts of the columns that conditions compare with texts."""

    def instant(self, place: int) -> tuple[float, float]:
        """TAI of a row."""
        return float(self.tai[0][place]), float(self.tai[1][place])


def named_columns(satellite: Satellite, conditions: Sequence[Condition]) -> dict[str, bool]:
    """Columns that the satellite file names, and whether they hold numbers that must be read."""
    names = {satellite.time.column: False}
    names |= {name: False for condition in conditions for name in condition.texts}
    names |= {name: True for condition in conditions for name in condition.columns if name not in condition.texts}
    names |= {name: True for channel in satellite.channels.values() for name in channel.columns if name}
    names |= dict.fromkeys(satellite.columns, True)
    if satellite.motion.columns:
        names |= dict.fromkeys(satellite.motion.columns, True)
    if satellite.orbit.columns:
        columns = satellite.orbit.columns
        names |= dict.fromkeys([*columns.position, *(columns.velocity or ())], True)
    return names


def joined(files: tuple[RawTable, ...], satellite: Satellite, conditions: Sequence[Condition]) -> Rows:
    """Returns the rows of all files; `InputError` where a column that is needed stands in none of them."""
    named = named_columns(satellite, conditions)
    for name in named:
        if name != satellite.time.column and not any(name in file.columns for file in files):
            # The error of the first file, which tells what is like it and has no use yet.
            files[0].column(name, named)
    stamps = [instants(file, satellite.time) for file in files]
    columns, texts = {}, {}
    for name, numeric in named.items():
        if numeric:
            columns[name] = np.concatenate([_numbers(file, name, satellite) for file in files])
        elif name != satellite.time.column:
            texts[name] = np.concatenate([_texts(file, name) for file in files])
    return Rows(
        files=files,
        file=np.repeat(np.arange(len(files)), [file.rows.size for file in files]),
        row=np.concatenate([file.rows for file in files]),
        tai=(np.concatenate([each[0] for each in stamps]), np.concatenate([each[1] for each in stamps])),
        columns=columns,
        texts=texts,
    )


def _numbers(file: RawTable, name: str, satellite: Satellite) -> np.ndarray:
    if name not in file.columns:
        return np.full(file.rows.size, np.nan)
    return numbers(file, name, satellite.rows.not_measured)


def _texts(file: RawTable, name: str) -> np.ndarray:
    if name not in file.columns:
        return np.full(file.rows.size, "", dtype=object)
    return np.array([str(cell) for cell in file.columns[name]], dtype=object)


def rejected(rows: Rows, places: np.ndarray, column: str, reason: str, details: Sequence[str]) -> list[RejectedRow]:
    """Rows, or a column or channel of them, that are left out for one reason."""
    return [
        RejectedRow(rows.files[rows.file[k]].path, int(rows.row[k]), column, reason, detail)
        for k, detail in zip(places.tolist(), details, strict=True)
    ]


def stamped(rows: Rows, column: str, rejections: list[RejectedRow]) -> np.ndarray:
    """Which rows have a stamp; the others are added to what is left out."""
    known = np.isfinite(rows.tai[1])
    missing = np.flatnonzero(~known)
    rejections += rejected(rows, missing, column, NO_STAMP, ["empty"] * missing.size)
    return known


def kept(rows: Rows, conditions: Sequence[Condition], rejections: list[RejectedRow]) -> np.ndarray:
    """Which rows meet all conditions; the others are added to what is left out, each with the first it fails."""
    used = np.ones(rows.row.size, dtype=bool)
    for condition in conditions:
        values = {
            name: rows.texts[name] if name in condition.texts else rows.columns[name] for name in condition.columns
        }
        against = np.flatnonzero(condition.violated(values) & used)
        details = [", ".join(f"{name} = {_shown(values[name][k])}" for name in condition.columns) for k in against]
        rejections += rejected(rows, against, ", ".join(condition.columns), f"not {condition.text}", details)
        used[against] = False
    return used


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def backward(rows: Rows, t_s: np.ndarray, used: np.ndarray) -> list[str]:
    """Where stamps of a file fall, in words."""
    remarks = []
    for number, file in enumerate(rows.files):
        places = np.flatnonzero(used & (rows.file == number))
        falls = places[1:][np.diff(t_s[places]) < 0.0]
        if falls.size:
            where = ", ".join(str(rows.row[k]) for k in falls[:5]) + (", ..." if falls.size > 5 else "")
            remarks.append(
                f"{file.path.name}: stamps go back {falls.size} times, at row {where}; rows are put in order"
            )
    return remarks
