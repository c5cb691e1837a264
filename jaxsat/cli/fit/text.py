"""What the terminal shows of a fit, and of several."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from fitting.report.page import fit_facts
from fitting.report.rows import STRONG_CORRELATION, parameter_rows, strong_correlations
from jaxsat.cli.shared.terminal import plain_table
from jaxsat.significant import count_text

if TYPE_CHECKING:
    from fitting.outcome.result import FitResult

STATUS_STYLE = {
    "converged": "bold green",
    "not_converged": "bold red",
    "ambiguous": "bold yellow",
    "failed": "bold red",
}


def fit_summary(result: "FitResult", name: str) -> RenderableType:
    """Returns status, parameters, facts and strong correlations of one fit."""
    status = Text.assemble(
        (name, "bold"),
        ": ",
        (result.status.replace("_", " "), STATUS_STYLE.get(result.status, "bold")),
        ". ",
        result.message,
    )
    rows = parameter_rows(result.parameters)
    parameters = plain_table("parameter", "value", "1σ", "unit", "note", right=(1,))
    for row in rows:
        if row[4] != "fixed":
            parameters.add_row(row[0], row[1], f"± {row[2]}" if row[2] else "", row[3], row[4])
    fixed = ", ".join(f"{row[0]} {row[1]} {row[3]}".strip() for row in rows if row[4] == "fixed")
    facts = Table.grid(padding=(0, 2))
    for what, text in fit_facts(result):
        facts.add_row(Text(what, style="dim"), text)
    parts: list[RenderableType] = [status, parameters]
    if fixed:
        parts.append(Padding(Text(f"fixed: {fixed}", style="dim"), (0, 0, 1, 0)))
    parts.append(facts)
    strong = strong_correlations(result.correlations)
    if strong:
        table = plain_table("strongly correlated", "with", "correlation", right=(2,))
        for a, b, value in strong[:8]:
            table.add_row(a, b, f"{value:+.3f}")
        parts.append(table)
        if len(strong) > 8:
            parts.append(
                Text(f"and {count_text(len(strong) - 8, 'pair')} more beyond ±{STRONG_CORRELATION} in fit.json")
            )
    return Group(*parts)


def files_summary(rows: Iterable[tuple[str, str, str]]) -> RenderableType:
    """Returns one line a file for a run over several: (file, status, message)."""
    table = plain_table("file", "status", "message")
    for file, status, message in rows:
        table.add_row(file, Text(status.replace("_", " "), style=STATUS_STYLE.get(status, "")), message)
    return table
