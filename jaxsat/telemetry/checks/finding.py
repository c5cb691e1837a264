"""One thing that a check says."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Finding:
    """A sentence about a channel, or about `stamps`, `rows`, `orbit`, with the numbers behind it."""

    about: str
    text: str
    odd: bool = False
    """Whether somebody should look at it before a fit."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """By names that carry their units."""


def finding(
    about: str, text: str, *, odd: bool | np.bool_ = False, numbers: Mapping[str, float | int] | None = None
) -> Finding:
    """Returns the finding in plain Python."""
    return Finding(about, text, bool(odd), {name: float(value) for name, value in (numbers or {}).items()})


def times_text(t_s: np.ndarray, limit: int = 5) -> str:
    """Times as text, cut after some."""
    shown = ", ".join(f"{t:g}" for t in t_s[:limit])
    return f"t = {shown}{', ...' if len(t_s) > limit else ''} s"
