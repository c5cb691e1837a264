"""What the terminal shows of a sensitivity: within 80 columns."""

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fitting.sensitivity.report.document import verdict
from jaxsat.cli.shared.terminal import plain_table
from jaxsat.significant import unit_text, value_text

if TYPE_CHECKING:
    from fitting.sensitivity.analysis import Sensitivity

SHOWN = 24
"""Numbers in the table, of which the rest is in the JSON file."""


def sensitivity_text(found: "Sensitivity", name: str, *, whole: bool) -> RenderableType:
    """Returns verdict and tables."""
    first, *rest = verdict(found)
    header = Text.assemble((name, "bold"), f": {first}.")
    lines = [Text(f"- {line}") for line in rest]
    parts: list[RenderableType] = [header, *lines, _numbers(found, whole), _channels(found)]
    return Group(*parts)


def _numbers(found: "Sensitivity", whole: bool) -> Table:
    considered = bool(found.choice.considered)
    columns = ["parameter", "1σ noise", *(["1σ assumed", "1σ"] if considered else []), "prior", "unit"]
    table = plain_table(*columns, right=range(1, len(columns) - 1))
    rows = found.quoted.rows
    for row in rows if whole else rows[:SHOWN]:
        cells = [value_text(row.sigma_noise, 3)]
        if considered:
            cells += [value_text(row.sigma_assumed, 3), value_text(row.sigma, 3)]
        table.add_row(row.name, *cells, "" if row.prior is None else value_text(row.prior, 3), unit_text(row.unit))
    if len(rows) > SHOWN and not whole:
        table.add_row(f"{len(rows) - SHOWN} more", *[""] * (len(columns) - 1))
    return table


def _channels(found: "Sensitivity") -> Table:
    moves = found.vantage.free_motion
    table = plain_table("channel", "readings", "share", *(["attitude without it"] if moves else []), right=(1, 2, 3))
    for each in found.contributions.channels:
        without = [f"{value_text(each.attitude_deg, 3)} deg"] if moves else []
        table.add_row(each.name, str(each.readings), f"{100 * each.share:.1f} %", *without)
    priors = found.contributions.priors
    if priors > 5e-4:
        table.add_row("priors", "", f"{100 * priors:.1f} %", *([""] if moves else []))
    return table
