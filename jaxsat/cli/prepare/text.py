"""What the terminal shows of a preparation."""

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.text import Text

from fitting.report.rows import element_rows, rejection_rows
from jaxsat.cli.shared.terminal import plain_table
from jaxsat.significant import count_text

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import OrbitFit
    from jaxsat.telemetry import Session


def preparation_summary(session: "Session", orbit_fit: "OrbitFit", name: str) -> RenderableType:
    """Returns what was read, what was left out and why, and the elements found."""
    used = count_text(session.raw_t_s.size, "row")
    header = Text.assemble(
        (name, "bold"),
        f": {used} give {count_text(session.t_s.size, 'sample')}, t = {session.t_s[0]:g} to {session.t_s[-1]:g} s, "
        f"epoch {session.epoch.iso(3)} UTC",
    )
    parts: list[RenderableType] = [header]
    rows = rejection_rows(session.rejections)
    if rows:
        table = plain_table("left out because", "count", "rows of the file", "first", right=(1,))
        for row in rows:
            table.add_row(*row)
        parts.append(table)
    else:
        parts.append(Text("nothing was left out"))
    elements = plain_table("orbital element", "value", "1σ", "unit", right=(1,))
    for row in element_rows(orbit_fit.elements, orbit_fit.sigma):
        elements.add_row(*row)
    before, after = orbit_fit.rms_before_m, orbit_fit.rms_after_m
    residuals = f"position residuals of a coordinate: RMS {before:.4g} m, after least squares {after:.4g} m"
    return Group(*parts, elements, Text(residuals))
