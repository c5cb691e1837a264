"""Figures of a flight: what was asked, what a first look had, what is measured; as lines and as JSON."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from jaxsat.files.json_files import plain, write_json


@dataclass(frozen=True)
class Figure:
    """One number that was asked for, or only told."""

    name: str
    measured: float
    unit: str
    asked: float | None = None
    """At most this."""
    before: float | None = None
    """By the prototype or with nominal numbers."""
    at_least: bool = False
    """Whether what was asked is a lower limit."""

    @property
    def reached(self) -> bool | None:
        """None where nothing was asked."""
        if self.asked is None:
            return None
        return self.measured >= self.asked if self.at_least else self.measured <= self.asked


def told(figures: list[Figure]) -> str:
    """A table, one figure a line."""
    lines = [f"{'':54}{'measured':>10}{'asked':>8}{'before':>8}"]
    for each in figures:
        asked = "" if each.asked is None else f"{each.asked:g}"
        before = "" if each.before is None else f"{each.before:.3g}"
        word = {True: "  reached", False: "  NOT REACHED", None: ""}[each.reached]
        lines.append(f"{each.name + ', ' + each.unit:54}{each.measured:10.3g}{asked:>8}{before:>8}{word}")
    return "\n".join(lines)


def write_figures(path: Path, schema: str, figures: list[Figure], **more: Any) -> None:
    """Writes them with whatever else belongs to them."""
    rows = [{**asdict(each), "reached": each.reached} for each in figures]
    write_json(path, plain({"schema": schema, "figures": rows, **more})[0])
