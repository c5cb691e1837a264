"""Cells that are no readings: numbers in place of what was not measured, as -999, what is stuck, the end of a range."""

import numpy as np

AGAIN = 3
"""Readings of one and the same number, from which on it may be a filler."""
FAR, LEAST_SIGMAS = 10.0, 10.0
"""A filler is beyond all others by this factor, and by so many sigmas."""
APART = 0.3
"""Of a row of one number its distance from the readings around it, over the size of a usual one."""
ALL_BUT = 0.98
"""Of other readings, single wild ones left out of account."""

AT_END, END_SHARE, TIMES_USUAL = 5, 0.02, 5
"""Readings at one end of the range, from which on it may be one: at least so many, of all such a share, and times what
any number between the ends has."""
IN_A_ROW, ROW_SHARE = 10, 0.05
"""The same of readings that are stuck at any number, one after the other."""


def fillers(values: np.ndarray, sigma: float, *, vector: bool) -> np.ndarray:
    """[rows columns] which cells of one channel are no readings, in order of time, all of them in one unit.

    A number that stands at least thrice in a column and is ten times beyond all others there; of a `vector` also one
    that fills a whole row at least thrice and is far from the rows before it, as of -999 among some 10 000 nT. Light
    may be dark for long and then steady, so of what is no vector only numbers below zero are taken.
    """
    found = np.zeros(values.shape, bool)
    if vector and values.shape[1] > 1:
        found |= _one_number(values, sigma)[:, None] & np.isfinite(values)
    left = np.where(found, np.nan, values)
    for k in range(values.shape[1]):
        found[:, k] |= _beyond_all(left[:, k], sigma, vector=vector)
    return found


def standing(values: np.ndarray) -> np.ndarray:
    """[rows columns], in order of time, which cells are stuck or stand at the end of a sensor's range.

    Readings with noise hardly repeat: neither the largest or the least number of a column many times, nor any number
    in a long row. Where others repeat too, of coarse steps, none is taken.
    """
    found = np.zeros(values.shape, bool)
    for k in range(values.shape[1]):
        column = values[np.isfinite(values[:, k]), k]
        numbers, counts = np.unique(column, return_counts=True)
        if numbers.size < AGAIN + 2:
            continue
        by_count = np.argsort(counts)
        usual = int(np.delete(counts, [0, counts.size - 1, *([by_count[-1]] if counts.size > 3 else [])]).max())
        if _longest_run(column, numbers[[0, -1, by_count[-1]]]) >= AGAIN:
            # Steps so coarse that readings stay on one: rest is not to be told from being stuck.
            continue
        for which in {0, numbers.size - 1, int(by_count[-1])}:
            at = np.flatnonzero(column == numbers[which])
            at_end = which in (0, numbers.size - 1)
            in_a_row = at.size == at[-1] - at[0] + 1
            least = (AT_END, END_SHARE) if at_end else (IN_A_ROW, ROW_SHARE)
            if (at_end or in_a_row) and at.size >= max(least[0], least[1] * column.size, TIMES_USUAL * usual):
                found[:, k] |= values[:, k] == numbers[which]
    return found


def _longest_run(column: np.ndarray, but: np.ndarray) -> int:
    """Most readings of one number after each other, of numbers that are none of these."""
    ends = np.flatnonzero(np.diff(column) != 0.0)
    edges = np.concatenate([[-1], ends, [column.size - 1]])
    lengths = np.diff(edges)[~np.isin(column[edges[1:]], but)]
    return int(lengths.max(initial=0))


def _repeated(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers that stand at least `AGAIN` times among these, and how often."""
    numbers, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    often = counts >= AGAIN
    return numbers[often], counts[often]


def _beyond_all(column: np.ndarray, sigma: float, *, vector: bool) -> np.ndarray:
    found = np.zeros(column.shape, bool)
    numbers, counts = _repeated(column)
    sizes = np.sort(np.abs(column[np.isfinite(column)]))
    smaller = np.searchsorted(sizes, np.abs(numbers) / FAR, side="right")
    left = sizes.size
    # The largest first: two fillers of one table must not hide each other.
    for k in np.argsort(-np.abs(numbers)):
        number = numbers[k]
        if not (vector or number < 0.0) or smaller[k] < ALL_BUT * (left - counts[k] - 1):
            # Too many others are not that much smaller. Of readings in steps nearly all numbers are repeated, and a
            # quantile for each of them would take seconds.
            continue
        others = np.abs(column[(column != number) & np.isfinite(column) & ~found])
        if others.any() and abs(number) > FAR * float(np.quantile(others, ALL_BUT)) + LEAST_SIGMAS * sigma:
            found |= column == number
            left -= counts[k]
    return found


def _one_number(values: np.ndarray, sigma: float) -> np.ndarray:
    """[rows] whole rows of one repeated number that are far from the rows before them."""
    whole = np.isfinite(values).all(axis=1)
    flat = whole & (np.ptp(np.nan_to_num(values), axis=1) == 0.0)
    found = np.zeros(len(values), bool)
    if not (whole & ~flat).any():
        return found
    size = float(np.median(np.linalg.norm(values[whole & ~flat], axis=1)))
    for number in _repeated(values[flat, 0])[0]:
        rows = np.flatnonzero(flat & (values[:, 0] == number))
        usual = np.flatnonzero(whole & ~flat)
        before = usual[np.maximum(np.searchsorted(usual, rows) - 1, 0)]
        apart = np.linalg.norm(values[rows] - values[before], axis=1)
        found[rows] = bool(np.median(apart) > max(APART * size, LEAST_SIGMAS * sigma))
    return found
