"""When two outputs of one command are alike: the same words, numbers as near as they are printed, times left out."""

import re
from pathlib import Path

LAST_DIGITS = 2.0
"""Numbers may differ by so many units of the last digit that is shown ..."""
SHARE = 1e-3
"""... or by this share of themselves: rounding of another processor, or the last step of a solver."""
TIMES = re.compile(
    r"\b(import|prepare|compile|solve|verify|chunk|run|merge|total|took)(:?\s+)\d+(?:\.\d+)?(\s+)(?:s|ms|min)\b"
)
RATES = re.compile(r"\d+(?:\.\d+)?(\s+cases/s)")
FOLDERS = re.compile(r"/tmp/[\w./-]+|page-\w+")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*(?:e[-+]?\d+)?|\binf\b|\bnan\b)")


def masked(text: str) -> str:
    """Without what differs from run to run: times of work, and folders that are made for it."""
    text = TIMES.sub(r"\1\2TIME\3s", text)
    return FOLDERS.sub("FOLDER", RATES.sub(r"RATE\1", text))


def alike(first: str, second: str, *, numbers: bool = True) -> bool:
    """Whether the words are the same, and the numbers within the tolerance unless `numbers` leaves them out.

    Lines and columns may be broken otherwise: where they end depends on numbers.
    """
    one, other = (re.sub(r"[─━]+", "─", masked(text)).split() for text in (first, second))
    if len(one) != len(other):
        return False
    return all(_same_word(a, b, numbers) for a, b in zip(one, other, strict=True))


def _same_word(a: str, b: str, numbers: bool) -> bool:
    if a == b:
        return True
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False
    pairs = zip(NUMBER.findall(a), NUMBER.findall(b), strict=True)
    return not numbers or all(_near(x, y) for x, y in pairs)


def _near(x: str, y: str) -> bool:
    allowed = max(LAST_DIGITS * _unit(x), LAST_DIGITS * _unit(y), SHARE * abs(float(x)))
    return x == y or abs(float(x) - float(y)) <= allowed


def _unit(number: str) -> float:
    """Of the last digit: 0.01 of 3.14, 1e-9 of 3.090e-06."""
    digits, _, power = number.partition("e")
    return 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))


def shortened(printed: str, shown: str | None) -> str:
    """Lines without spaces at their ends; of many only the first and last, as `12+5`, with dots between."""
    lines = [line.rstrip() for line in printed.strip("\n").splitlines()]
    if shown:
        first, last = map(int, shown.split("+"))
        if len(lines) > first + last:
            lines = [*lines[:first], "...", *lines[len(lines) - last :]]
    return "".join(f"{line}\n" for line in lines)


def same_picture(one: Path, other: Path) -> bool:
    """Whether two PNG files show the same: equal in size, and in all but a few pixels, which rounding moves."""
    import numpy as np
    from matplotlib.image import imread

    a, b = imread(one), imread(other)
    return a.shape == b.shape and float(np.mean(np.abs(a - b) > 0.1)) < 1e-4
