"""A number of a scenario that an engineer would turn, and by what it is moved."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from jaxsat.errors import InputError


@dataclass(frozen=True)
class Knob:
    """A gain, a limit, a mass, or the size of an error: what the mean of a metric may be differentiated by.

    A case is run with its knobs moved by numbers without a unit, 0 for none: a positive knob by a factor, of which the
    number is the logarithm; one that may be zero or negative by a sum, so many times `shift`.
    """

    name: str
    unit: str
    """`1` for a pure number."""
    meaning: str
    value: float
    """With the options that the scenario has, in the unit."""
    shift: float | None = None
    """What a move of 1 adds, in the unit; None: it is moved by factors."""

    @property
    def per(self) -> tuple[float, str]:
        """The move that a table tells the effect of, and its name: +1 %, one unit, or of a pure number a hundredth."""
        if self.shift is None:
            return 0.01, "+1 %"
        return (0.01 / self.shift, "+0.01") if self.unit == "1" else (1.0 / self.shift, f"+1 {self.unit}")


def check_knobs(knobs: Sequence[Knob]) -> None:
    """ValueError where two have one name, or one can be moved in no way."""
    names = [knob.name for knob in knobs]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"two knobs would be called {twice[0]}")
    for knob in knobs:
        if knob.shift is None and not (knob.value > 0.0 and np.isfinite(knob.value)):
            raise ValueError(f"knob {knob.name}: expected a positive number to be moved by factors, got {knob.value}")
        if knob.shift is not None and not (knob.shift > 0.0 and np.isfinite(knob.shift)):
            raise ValueError(f"knob {knob.name}: expected a positive shift, got {knob.shift}")


def places_of(wanted: Iterable[str], names: Sequence[str], kind: str) -> list[int]:
    """Where the wanted names stand among `names`; `InputError` for one that is none or comes twice.

    `kind` is what they are called: knob, metric.
    """
    found: list[int] = []
    for name in wanted:
        if name not in names:
            close = get_close_matches(name, names, n=1)
            hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"
            raise InputError(f"no such {kind} of this scenario; {hint}", field=name)
        if names.index(name) in found:
            raise InputError(f"is named twice among the {kind}s", field=name)
        found.append(names.index(name))
    return found
