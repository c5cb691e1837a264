"""What the terminal shows of a fit of any satellite: what counts comes last, where a screen of 24 lines ends."""

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


def fit_text(
    result: "FitResult", name: str, rejections: Iterable["RejectedRow"] = (), *, whole: bool = False
) -> RenderableType:
    """Returns facts, remarks, channels, parameters with what they buy, alternatives and verdict; fits 100 columns.

    `rejections` are rows and cells of the table that were not used. `whole` cuts nothing short.
    """
    facts = Table.grid(padding=(0, 2))
    for what, text in [*fit_facts(result), *_left_out(rejections)]:
        facts.add_row(Text(what, style="dim"), text)
    parts: list[RenderableType] = [facts, *_correlations(result, whole), *_fixed(result, whole)]
    parts += [Text.assemble(("- ", "yellow"), f"{remark[:1].upper()}{remark[1:]}.") for remark in result.remarks]
    channels = plain_table(*CHANNEL_COLUMNS, right=CHANNEL_NUMBERS)
    # Nine columns stand closer, so that they fit a terminal of 80.
    channels.padding = (0, 1, 0, 0)
    for row in channel_rows(result):
        channels.add_row(*row)
    parts += [channels, *_parameters(result), *_alternatives(result, whole), *_causes(result, whole)]
    style = STYLES[VERDICTS.get(result.verdict, "bad")]
    message = f"{result.message[:1].upper()}{result.message[1:]}."
    return Group(*parts, Text.assemble((name, "bold"), ": ", (verdict_text(result), style), " ", message))


def _correlations(result: "FitResult", whole: bool) -> Iterable[RenderableType]:
    strong = strong_correlations({a: dict(row) for a, row in result.correlations.items()})
    shown = len(strong) if whole else SHOWN_PAIRS
    if strong:
        table = plain_table("strongly correlated", "with", "correlation", right=(2,))
        for a, b, value in strong[:shown]:
            table.add_row(a, b, f"{value:+.3f}")
        yield table
        if len(strong) > shown:
            more = count_text(len(strong) - shown, "pair")
            yield Text(f"and {more} more beyond ±{STRONG_CORRELATION} in fit.json\n", style="dim")


def _parameters(result: "FitResult") -> Iterable[RenderableType]:
    free = {p.name for p in result.parameters if p.free}
    if free:
        table = plain_table("parameter", "value", "1σ", "unit", "buys chi2", "note", right=(1, 4))
        table.columns[0].no_wrap = True
        for name, value, sigma, unit, buys, note in worth_rows(result):
            if name in free:
                table.add_row(name, value, f"± {sigma}" if sigma else "", unit, buys, note)
        yield table


def _fixed(result: "FitResult", whole: bool) -> Iterable[RenderableType]:
    free = {p.name for p in result.parameters if p.free}
    rows = [(name, f"{value} {unit}".strip()) for name, value, _, unit, *_ in worth_rows(result) if name not in free]
    fixed = [f"{name} {value}" for name, value in rows] if whole else _together(rows)
    if fixed:
        shown = len(fixed) if whole else SHOWN_FIXED
        more = f", and {len(fixed) - shown} more in fit.json" if len(fixed) > shown else ""
        yield Padding(Text(f"fixed: {', '.join(fixed[:shown])}{more}", style="dim"), (0, 0, 1, 0))


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


def _alternatives(result: "FitResult", whole: bool) -> Iterable[RenderableType]:
    rows = alternative_rows(result)
    shown = len(rows) if whole else SHOWN_ALTERNATIVES
    if rows:
        heads = "other motions or axes: chi2 above", "attitude differs by", "rate, deg/s", "axes"
        table = plain_table(*heads, right=(0, 1))
        for row in rows[:shown]:
            table.add_row(*row)
        yield table
        if len(rows) > shown:
            yield Text(f"and {len(rows) - shown} more in fit.json\n", style="dim")


def _causes(result: "FitResult", whole: bool) -> Iterable[RenderableType]:
    rows = cause_rows(result)
    if rows:
        table = plain_table("what would explain the data", "chi2 before", "after", "it would mean", right=(1, 2))
        for cause, before, after, meaning, _ in rows[: len(rows) if whole else SHOWN_CAUSES]:
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
