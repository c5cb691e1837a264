"""Tables of numbers over time as CSV: seconds, UTC, ten digits, empty where a number is not known."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from jaxsat.time import Epoch


def write_columns_csv(path: Path, t_s: np.ndarray, epoch: Epoch, columns: Mapping[str, np.ndarray]) -> None:
    """Writes `t_s`, `utc` and named columns [time], units in their names; an empty field is a number not known."""
    numbers = np.column_stack(list(columns.values()))
    write_numbers_csv(path, ["t_s", "utc", *columns], t_s, epoch, numbers)


def write_numbers_csv(path: Path, columns: Iterable[str], t_s: np.ndarray, epoch: Epoch, numbers: np.ndarray) -> None:
    """Writes one row of `numbers` [time fields] a time, with its time and UTC in front; see `csv_numbers`."""
    rows = zip(csv_numbers(t_s[:, None]), epoch.iso_texts(t_s), csv_numbers(numbers), strict=True)
    with path.open("w", newline="", encoding="utf-8") as stream:
        stream.write(",".join(columns) + "\n")
        stream.writelines(f"{t},{utc},{row}\n" for t, utc, row in rows)


def csv_numbers(numbers: np.ndarray) -> list[str]:
    """Returns the fields of each row with ten digits and commas between; a number that is not finite is empty."""
    pattern = ",".join(["%.10g"] * numbers.shape[1])
    texts = [pattern % tuple(row) for row in numbers.tolist()]
    for k in np.flatnonzero(~np.isfinite(numbers).all(axis=1)):
        texts[k] = ",".join(f"{x:.10g}" if math.isfinite(x) else "" for x in numbers[k])
    return texts
