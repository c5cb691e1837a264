"""What a scenario draws at random for each case, said once: its name, unit, meaning, and where it is found.

Each is a column `in_NAME_UNIT` of a sweep's table, or several of them, so that a result can be laid beside what it came
from (`jaxsat sensitivity SWEEP_DIR`), and a case can be made again by another program.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

PREFIX = "in_"


@dataclass(frozen=True)
class Input:
    """One thing that is drawn: a number, or a few that are drawn together, as the axes of a vector."""

    name: str
    unit: str
    """`1` for a pure number."""
    meaning: str
    """With the axes that it is in."""
    of: Callable[[Any], np.ndarray]
    """Its values [cases], or [cases parts], from what `Scenario.draw` returns."""
    parts: tuple[str, ...] = ()
    """Names of the numbers, as x, y, z; a single number has none."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of its columns: `in_NAME_PART_UNIT`."""
        unit = unit_words(self.unit)
        words = ([self.name, part, unit] for part in self.parts or ("",))
        return tuple(PREFIX + "_".join(filter(None, word)) for word in words)

    def values(self, drawn: Any, cases: int) -> dict[str, np.ndarray]:
        """Each of its columns [cases, float64]; ValueError where they have another shape."""
        found = np.asarray(self.of(drawn), np.float64)
        expected = (cases, len(self.parts)) if self.parts else (cases,)
        if found.shape != expected:
            raise ValueError(f"input {self.name} has shape {found.shape}, expected {expected}")
        return dict(zip(self.columns, found.reshape(cases, -1).T, strict=True))


def unit_words(unit: str) -> str:
    """A unit as names of columns have it: `deg_s` of deg/s, nothing of a pure number."""
    return "" if unit == "1" else "_".join(re.findall(r"\w+", unit))


def check_inputs(inputs: Iterable[Input], taken: Iterable[str]) -> None:
    """ValueError where two columns would have one name."""
    names = [*taken, *(column for one in inputs for column in one.columns)]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"two columns would be called {twice[0]}")


def upright(quaternion: np.ndarray) -> np.ndarray:
    """Quaternions [cases 4], scalar first, as the one of the two of an attitude whose scalar is not negative."""
    return np.where(quaternion[:, :1] < 0.0, -quaternion, quaternion)
