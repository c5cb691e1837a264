"""What the terminal shows of a fit of any satellite."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from fitting.report.fit.result_rows import (
    CHANNEL_COLUMNS,
    CHANNEL_NUMBERS,
    VERDICTS,
    alternative_rows,
    cause_rows,
    channel_rows,
    fit_facts,
    left_out_text,
    verdict_text,
    worth_rows,
)
from fitting.report.rows import STRONG_CORRELATION, strong_correlations
from jaxsat.cli.shared.terminal import plain_table
from jaxsat.significant import count_text

if TYPE_CHECKING:
    from fitting.outcome.result import FitResult
    from jaxsat.telemetry import RejectedRow

STATUS_STYLES = {
    "converged": "bold green",
    "not_converged": "bold red",
    "ambiguous": "bold yellow",
    "failed": "bold red",
}
STYLES = {"good": "bold green", "doubtful": "bold yellow", "bad": "bold red"}
SHOWN_ALTERNATIVES, SHOWN_FIXED, SHOWN_PAIRS, SHOWN_CAUSES = 5, 8, 6, 4


def fit_text(result: "FitResult", name: str, rejections: Iterable["RejectedRow"] = ()) -> RenderableType:
    """Returns verdict, channels, parameters with what they buy, alternatives, facts and remarks; fits 100 columns.

    `rejections` are rows and cells of the table that were not used.
    """
    style = STYLES[VERDICTS.get(result.verdict, "bad")]
    message = f"{result.message[:1].upper()}{result.message[1:]}."
    parts: list[RenderableType] = [Text.assemble((name, "bold"), ": ", (verdict_text(result), style), " ", message)]
    channels = plain_table(*CHANNEL_COLUMNS, right=CHANNEL_NUMBERS)
    # Nine columns stand closer, so that they fit a terminal of 80.
    channels.padding = (0, 1, 0, 0)
    for row in channel_rows(result):
        channels.add_row(*row)
    parts.append(channels)
    parts += _parameters(result)
    parts += _alternatives(result)
    parts += _causes(result)
    facts = Table.grid(padding=(0, 2))
    for what, text in [*fit_facts(result), *_left_out(rejections)]:
        facts.add_row(Text(what, style="dim"), text)
    parts.append(facts)
    strong = strong_correlations({a: dict(row) for a, row in result.correlations.items()})
    if strong:
        table = plain_table("strongly correlated", "with", "correlation", right=(2,))
        for a, b, value in strong[:SHOWN_PAIRS]:
            table.add_row(a, b, f"{value:+.3f}")
        parts.append(table)
        if len(strong) > SHOWN_PAIRS:
            more = count_text(len(strong) - SHOWN_PAIRS, "pair")
            parts.append(Text(f"and {more} more beyond ±{STRONG_CORRELATION} in fit.json\n", style="dim"))
    parts += [Text.assemble(("- ", "yellow"), f"{remark[:1].upper()}{remark[1:]}.") for remark in result.remarks]
    return Group(*parts)


def _parameters(result: "FitResult") -> Iterable[RenderableType]:
    free = {p.name for p in result.parameters if p.free}
    rows = worth_rows(result)
    if free:
        table = plain_table("parameter", "value", "1σ", "unit", "buys chi2", "note", right=(1, 4))
        for name, value, sigma, unit, buys, note in rows:
            if name in free:
                table.add_row(name, value, f"± {sigma}" if sigma else "", unit, buys, note)
        yield table
    fixed = _together([(name, f"{value} {unit}".strip()) for name, value, _, unit, _, _ in rows if name not in free])
    if fixed:
        more = f", and {len(fixed) - SHOWN_FIXED} more in fit.json" if len(fixed) > SHOWN_FIXED else ""
        yield Padding(Text(f"fixed: {', '.join(fixed[:SHOWN_FIXED])}{more}", style="dim"), (0, 0, 1, 0))


def _together(fixed: list[tuple[str, str]]) -> list[str]:
    """Names with values, a part whose numbers are all the same as one."""
    parts: dict[str, list[tuple[str, str]]] = {}
    for name, value in fixed:
        parts.setdefault(name.rpartition(".")[0] or name, []).append((name, value))
    found = []
    for part, own in parts.items():
        alike = len(own) > 1 and len({value for _, value in own}) == 1
        found += [f"{part} {own[0][1]}"] if alike else [f"{name} {value}" for name, value in own]
    return found


def _alternatives(result: "FitResult") -> Iterable[RenderableType]:
    rows = alternative_rows(result)
    if rows:
        table = plain_table(
            "other motions or axes: chi2 above", "attitude differs by", "rate, deg/s", "axes", right=(0, 1)
        )
        for row in rows[:SHOWN_ALTERNATIVES]:
            table.add_row(*row)
        yield table
        if len(rows) > SHOWN_ALTERNATIVES:
            yield Text(f"and {len(rows) - SHOWN_ALTERNATIVES} more in fit.json\n", style="dim")


def _causes(result: "FitResult") -> Iterable[RenderableType]:
    rows = cause_rows(result)
    if rows:
        table = plain_table("what would explain the data", "chi2 before", "after", "it would mean", right=(1, 2))
        for cause, before, after, meaning, _ in rows[:SHOWN_CAUSES]:
            table.add_row(cause, before, after, meaning)
        yield table
        option = rows[0][-1]
        if option and result.causes[0].explains:
            yield Text(f"to fit it so: {option}\n", style="bold")


def _left_out(rejections: Iterable["RejectedRow"]) -> list[tuple[str, str]]:
    text = left_out_text(rejections)
    return [("left out before the fit", text)] if text else []


def files_summary(rows: Iterable[tuple[str, str, str]]) -> RenderableType:
    """Returns one line a file for a run over several: (file, status, message)."""
    table = plain_table("file", "status", "message")
    for file, status, message in rows:
        table.add_row(file, Text(status.replace("_", " "), style=STATUS_STYLES.get(status, "")), message)
    return table
