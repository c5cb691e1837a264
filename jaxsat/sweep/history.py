"""One case of a sweep over its time, as its scenario returns it; whoever asked for it writes files and pictures."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np


@dataclass(frozen=True)
class Page:
    """What an interactive page shows of a case, beside its picture."""

    script: Literal["search"]
    """Which script of `jaxsat.report` draws it from the `data`; also its name."""
    heading: str
    good: bool
    """Whether the verdict is."""
    verdict: str
    message: str
    alternative: str
    """What the picture shows, in words."""
    data: Mapping[str, Any]
    """JSON, angles in degrees."""


@dataclass(frozen=True)
class History:
    """Times, numbers and curves of one case."""

    t_s: np.ndarray
    """[time]"""
    columns: Mapping[str, np.ndarray]
    """Of the table, each [time]; the names carry the units."""
    panels: Mapping[str, Mapping[str, np.ndarray]]
    """Of the picture, from the top: title with the unit, then the curves [time] by their names; one alone has none."""
    remark: str = ""
    """What of the options is worth saying beside the seed."""
    page: Page | None = None
