"""What the terminal shows of a sensitivity: within 80 columns."""

from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from fitting.sensitivity.report.document import verdict
from jaxsat.cli.shared.terminal import plain_table
from jaxsat.significant import count_text, unit_text, value_text

if TYPE_CHECKING:
    from fitting.sensitivity.analysis import Sensitivity
    from fitting.sensitivity.scenarios.many import Scenarios

UNKNOWN_DEG = 180.0
"""1-sigma of an attitude beyond which nothing is known of it."""
SHOWN = 24
"""Numbers in the table, of which the rest is in the JSON file."""


def sensitivity_text(
    found: "Sensitivity", name: str, drawn: "Scenarios | None" = None, *, whole: bool
) -> RenderableType:
    """Returns verdict and tables."""
    first, *rest = verdict(found)
    header = Text.assemble((name, "bold"), f": {first}.")
    lines = [Text(f"- {line}") for line in rest]
    parts: list[RenderableType] = [header, *lines, _numbers(found, whole), _channels(found)]
    if drawn is not None:
        parts += [_scenarios(drawn)]
    return Group(*parts)


def _scenarios(drawn: "Scenarios") -> RenderableType:
    """Percentiles of the attitude over all scenarios and by spin rate."""
    from fitting.sensitivity.report.drawn import PERCENTILES, scenarios_document

    told = scenarios_document(drawn)
    titles = [f"{p} %" for p in PERCENTILES]
    table = plain_table(
        "spin, deg/s", "scenarios", *titles, right=(1, 2, 3, 4), title="Attitude 1σ over scenarios, deg RMS"
    )
    for row in told["by_spin_deg_s"]:
        cells = (value_text(row[f"p{p:02d}"], 3) for p in PERCENTILES)
        table.add_row(f"{row['from']:.3g} to {row['to']:.3g}", str(row["count"]), *cells)
    cells = (value_text(told["attitude_rms_deg"][f"p{p:02d}"], 3) for p in PERCENTILES)
    table.add_row("all", str(told["count"]), *cells)
    speed = "" if told["scenarios_per_s"] is None else f"{told['scenarios_per_s']:.0f} scenarios a second, "
    return Group(table, Text(f"{speed}{count_text(told['instants'], 'instant')}"))


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
        known = each.attitude_deg < UNKNOWN_DEG
        without = [f"{value_text(each.attitude_deg, 3)} deg" if known else "unknown"] if moves else []
        table.add_row(each.name, str(each.readings), f"{100 * each.share:.1f} %", *without)
    priors = found.contributions.priors
    if priors > 5e-4:
        table.add_row("priors", "", f"{100 * priors:.1f} %", *([""] if moves else []))
    return table
