"""Options that several commands share: one meaning, one check and one wording each."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import CycloptsError, Parameter, Token

from fitting.parameters.names import parse_free


def _check_free(_: Any, value: str | None) -> None:
    if value is not None:
        parse_free(value)


def checked_free(value: str | None) -> str | None:
    """The same as it was; wrong usage where it names what Munin has not."""
    try:
        _check_free(None, value)
    except ValueError as error:
        raise CycloptsError(msg=f"Invalid value for --free: {error}") from None
    return value


def _check_intervals(_: Any, value: Sequence[Any] | None) -> None:
    for begin, end in [] if value is None else [value] if isinstance(value, tuple) else value:
        if not (math.isfinite(begin) and math.isfinite(end) and begin < end):
            raise ValueError(f"Expected two times in seconds, the first before the second, got {begin:g} {end:g}.")


def whole_number(_: Any, tokens: Sequence[Token]) -> int:
    """Returns a whole number; unlike the library's own conversion it does not round `1.5`."""
    text = tokens[0].value
    if not re.fullmatch(r"[+-]?[0-9]{1,18}", text):
        raise ValueError(f"Expected a whole number, got {text}.")
    return int(text)


Free = Annotated[
    str | None,
    Parameter(
        help="What is fitted: any of state,magnet,rods,imax,gains,inertia,albedo,tilts, a single one as "
        "albedo.specular or magnet.azimuth, or a classic name: als, alsI0, alsI23, alsImax, alsJ, alsI0J. The state "
        "is always free. [default: that of the configuration]",
        validator=_check_free,
    ),
]
ConfigFile = Annotated[
    Path | None, Parameter(help="Configuration, TOML; `jaxsat config` prints all keys with units and defaults.")
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
