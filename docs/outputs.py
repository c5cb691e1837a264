"""When two outputs of one command are alike: the same words, numbers as near as they are printed, times left out."""

import re
from pathlib import Path

LAST_DIGITS = 2.0
"""Numbers with a point may differ by so many units of the last digit that is shown ..."""
SHARE = 1e-3
"""... or, with those of at least three digits, by this share of themselves: rounding of another processor, or the last
step of a solver. Below a hundred what has no point is a count."""
TIMES = re.compile(
    r"\b(import|prepare|compile|solve|verify|chunk|run|merge|total|took)(:?\s+)\d+(?:\.\d+)?(\s+)(?:s|ms|min)\b"
)
RATES = re.compile(r"\d+(?:\.\d+)?(\s+cases/s)")
DOTS = "..."
"""A line of an output that stands for those that are not shown."""
FOLDERS = re.compile(r"/tmp/[\w./-]+|page-\w+")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*(?:e[-+]?\d+)?|\binf\b|\bnan\b)")


def masked(text: str) -> str:
    """Without what differs from run to run: times of work, and folders that are made for it."""
    text = TIMES.sub(r"\1\2TIME\3s", text)
    return FOLDERS.sub("FOLDER", RATES.sub(r"RATE\1", text))


def alike(shown: str, printed: str, *, numbers: bool = True) -> bool:
    """Whether `shown` is what was printed: the same words, and with `numbers` the same numbers within the tolerance.

    A line `...` stands for any others. Lines and columns may be broken otherwise: where they end depends on numbers.
    """
    return _where(shown, printed, numbers) is not None


def renewed(shown: str, printed: str, *, numbers: bool = True) -> str:
    """What is printed now, with lines left out where they were; `shown` itself, to the byte, if that is alike.

    Raises:
        ValueError: lines around dots are no longer there.
    """
    if alike(shown, printed, numbers=numbers):
        return shown
    lines = [line.rstrip() for line in printed.strip("\n").splitlines()]
    if len(_pieces(shown)) == 1:
        return "".join(f"{line}\n" for line in lines)
    places = _where(shown, printed.strip("\n"), numbers=False)
    if places is None:
        raise ValueError(f"shown:\n{shown}\nprinted:\n{printed}")
    return f"{DOTS}\n".join("".join(f"{line}\n" for line in lines[place]) for place in places)


def _pieces(shown: str) -> list[list[str]]:
    """The words before, between and behind lines of dots."""
    return [piece.split() for piece in re.split(r"^\.\.\.$", _plain(shown), flags=re.MULTILINE)]


def _plain(text: str) -> str:
    """With one dash for a rule, however long."""
    return re.sub(r"[─━]+", "─", masked(text))


def _where(shown: str, printed: str, numbers: bool) -> list[slice] | None:
    """The lines of each piece in what was printed; None where one is missing."""
    there = [(word, number) for number, line in enumerate(_plain(printed).splitlines()) for word in line.split()]
    pieces, places, at = _pieces(shown), [], 0
    for index, piece in enumerate(pieces):
        if len(pieces) > 1 and not piece:
            places.append(slice(0, 0))
            continue
        # What no dots stand before begins at the beginning; what none stand behind ends at the end.
        end = len(there) - len(piece)
        starts = range(end if index == len(pieces) - 1 else at, end + 1) if index else range(1)
        for start in starts:
            found = there[start : start + len(piece)]
            if start >= at and len(found) == len(piece) and _same_words(piece, [word for word, _ in found], numbers):
                break
        else:
            return None
        at = start + len(piece)
        places.append(slice(found[0][1], found[-1][1] + 1) if found else slice(0, 0))
    return places if at == len(there) or not pieces[-1] and len(pieces) > 1 else None


def _same_words(some: list[str], others: list[str], numbers: bool) -> bool:
    return all(_same_word(a, b, numbers) for a, b in zip(some, others, strict=True))


def _same_word(a: str, b: str, numbers: bool) -> bool:
    if a == b:
        return True
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return False
    pairs = zip(NUMBER.findall(a), NUMBER.findall(b), strict=True)
    return not numbers or all(_near(x, y) for x, y in pairs)


def _near(x: str, y: str) -> bool:
    size = abs(float(x))
    if x.lstrip("+-").isdigit() and y.lstrip("+-").isdigit():
        allowed = max(1.0, SHARE * size) if size >= 100.0 else 0.0
    else:
        allowed = max(LAST_DIGITS * _unit(x), LAST_DIGITS * _unit(y), SHARE * size)
    return x == y or abs(float(x) - float(y)) <= allowed


def _unit(number: str) -> float:
    """Of the last digit: 0.01 of 3.14, 1e-9 of 3.090e-06."""
    digits, _, power = number.partition("e")
    return 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))


def same_picture(one: Path, other: Path) -> bool:
    """Whether two PNG files show the same: equal in size, and in all but a few pixels, which rounding moves."""
    import numpy as np
    from matplotlib.image import imread

    a, b = imread(one), imread(other)
    return a.shape == b.shape and float(np.mean(np.abs(a - b) > 0.1)) < 1e-4
