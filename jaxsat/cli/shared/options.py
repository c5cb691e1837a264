"""Options that several commands share: one meaning, one check and one wording each."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, Token

from jaxsat.files.as_if import AsIf


def _check_intervals(_: Any, value: Sequence[Any] | None) -> None:
    for begin, end in [] if value is None else [value] if isinstance(value, tuple) else value:
        if not (math.isfinite(begin) and math.isfinite(end) and begin < end):
            raise ValueError(f"Expected two times in seconds, the first before the second, got {begin:g} {end:g}.")


def check_direction(_: Any, value: tuple[float, float, float] | None) -> None:
    """Refuses what points nowhere."""
    if value is not None and not all(map(math.isfinite, value)):
        raise ValueError("Expected a finite number.")
    if value is not None and not any(value):
        raise ValueError("Expected a direction, not zeros.")


def whole_number(_: Any, tokens: Sequence[Token]) -> int:
    """Returns a whole number; unlike the library's own conversion it does not round `1.5`."""
    text = tokens[0].value
    if not re.fullmatch(r"[+-]?[0-9]{1,18}", text):
        raise ValueError(f"Expected a whole number, got {text}.")
    return int(text)


def check_options(_: Any, value: Sequence[str] | None) -> None:
    """Refuses what is no NAME=VALUE, and a name that comes twice."""
    for text in value or ():
        if not re.fullmatch(r"[^=\s]+=.+", text):
            raise ValueError(f'Expected NAME=VALUE, got "{text}".')
    names = [text.partition("=")[0] for text in value or ()]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(f"{twice[0]} is set more than once.")


def check_changes(_: Any, value: Sequence[str] | None) -> None:
    """Refuses what is no change of the data."""
    for text in value or ():
        AsIf.of(text)


ConfigFile = Annotated[
    Path | None, Parameter(help="Configuration, TOML; `jaxsat config` prints all keys with units and defaults.")
]
AxisBody = Annotated[
    tuple[float, float, float] | None,
    Parameter(
        help="X Y Z: direction in body axes that lies along the field. [default: that of the satellite's magnet]",
        negative=(),
        validator=check_direction,
    ),
]
Arc = Annotated[
    tuple[float, float] | None,
    Parameter(help="T0 T1: fit only the samples between, s since the epoch.", negative=(), validator=_check_intervals),
]
Drop = Annotated[
    list[tuple[float, float]] | None,
    Parameter(
        help="T0 T1: leave out the samples between, s since the first good one; repeatable.",
        negative=(),
        validator=_check_intervals,
    ),
]
