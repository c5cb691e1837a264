"""What a sweep leaves when all of its chunks are there, and what the terminal shows of it."""

import functools
import json
import math
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from jaxsat.cli.shared.terminal import plain_table
from jaxsat.cli.sweep.progress import rate_text
from jaxsat.files.json_files import json_text, plain
from jaxsat.files.whole_file import write_whole
from jaxsat.significant import count_text, spans_text, unit_text, value_text
from jaxsat.sweep import MetricSummary, Scenario, SweepPlan, merge_cases, summarise
from jaxsat.sweep.merge import read_metric
from jaxsat.sweep.names import title_of_scenario
from jaxsat.sweep.summary import document

COMPARED = "compared_with_float64"
"""Key of summary.json."""
SPANS = 8
"""Runs of case numbers shown of each way to fail."""


def finish(
    scenario: Scenario,
    plan: SweepPlan,
    directory: Path,
    *,
    ran: int,
    timing: dict[str, float],
    began: float,
    plots: bool,
    replay: tuple[str, ...],
    compare: Callable[[np.ndarray], dict[str, Any]] | None = None,
) -> tuple[dict[str, Any], np.ndarray]:
    """Merges the chunks and writes cases.parquet, distributions.png, sweep.html and summary.json.

    `ran` is the number of cases that this process ran in `timing["run"]` seconds; it began at `began` (perf_counter);
    `replay` are the words of the command that shows a case; `compare(status)` says how far a sweep in single precision
    is from one in double. Returns the summary's content and the status numbers [cases].
    """
    from jaxsat.report.sweep_page import sweep_page

    begin = time.perf_counter()
    devices: Counter[str] = Counter()
    status = merge_cases(scenario, plan, directory, devices=devices)
    metrics = summarise(scenario, directory, status)
    png = None
    if plots:
        png = draw(metrics, plan, status)
        write_whole(directory / "distributions.png", lambda stream, png=png: stream.write(png))
    else:
        (directory / "distributions.png").unlink(missing_ok=True)
    timing["merge"] = time.perf_counter() - begin
    begin, path = time.perf_counter(), directory / "summary.json"
    compared = {} if compare is None else ran == 0 and _earlier(path, COMPARED) or {COMPARED: compare(status)}
    if compare is not None:
        timing["compare"] = time.perf_counter() - begin
    timing["total"] = time.perf_counter() - began
    earlier = _earlier(path, "timing_s", "cases_per_s", "cases_run") if ran == 0 else None
    own = {"timing_s": timing, "cases_per_s": ran / timing["run"] if ran else 0.0, "cases_run": ran}
    where = {"devices": {name: count for name, count in devices.items() if name}}
    content, _ = plain(document(scenario, plan, status, metrics, **where, **compared, **(earlier or own)))
    shown = sweep_page(
        scenario,
        content,
        status,
        metrics,
        functools.partial(read_metric, directory),
        command=replay,
        success=f"That is {share_text(content['success'])}.",
        png=png,
    )
    write_whole(directory / "sweep.html", lambda stream: stream.write(shown.encode()))
    write_whole(directory / "summary.json", lambda stream: stream.write(json_text(content).encode()))
    return content, status


def _earlier(path: Path, *keys: str) -> dict[str, Any] | None:
    """What a summary tells of the run that it is of, for one that only merged again."""
    try:
        found = json.loads(path.read_text("utf-8"))
        return {key: found[key] for key in keys}
    except (OSError, ValueError, KeyError, TypeError):
        return None


def draw(metrics: list[MetricSummary], plan: SweepPlan, status: np.ndarray) -> bytes:
    """Returns the histograms as PNG."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.distributions import draw_distributions

    failed = int(np.count_nonzero(status))
    subtitle = f"{count_text(plan.cases, 'case')}, seed {plan.seed}, {failed} failed"
    return png_bytes(draw_distributions(metrics, title=title_of_scenario(plan.scenario), subtitle=subtitle))


def sweep_summary(content: dict[str, Any], status: np.ndarray, *, whole: bool = False) -> RenderableType:
    """Returns how many cases succeeded, the metrics, and which cases failed in which way: all of them if `whole`."""
    failed = content["cases"] - content["succeeded"]
    header = Text.assemble(
        (content["scenario"], "bold"),
        f": {count_text(content['cases'], 'case')}, seed {content['seed']}{_in_single(content)}, ",
        (f"{content['succeeded']} succeeded", "bold green"),
        ", ",
        (f"{failed} failed", "bold red" if failed else ""),
    )
    some_without = any(m["missing"] for m in content["metrics"].values())
    # A column that says the same of all would fold the names.
    more = ("of",) if some_without else ()
    metrics = plain_table("metric", "5 %", "50 %", "95 %", "max", "unit", *more, right=(1, 2, 3, 4, 6))
    for name, m in content["metrics"].items():
        numbers = (_text(m[key]) for key in ("p05", "p50", "p95", "max"))
        metrics.add_row(name, *numbers, unit_text(m["unit"]), *((str(m["of"]),) if some_without else ()))
        if m["missing"] and "all_cases" in m:
            shown = m["all_cases"]
            metrics.add_row("  of all", *(_text(shown[p]) for p in ("p05", "p50", "p95")), "none", "", str(shown["of"]))
    of = count_text(content["success"]["of"], "case")
    share = Text(f"succeeded: {share_text(content['success'])} of {of}")
    parts: list[RenderableType] = [header, share, metrics]
    if failed:
        table = plain_table("failed because", "cases", "which", right=(1,))
        for code, (name, count) in enumerate(content["statuses"].items()):
            if code and count:
                which = np.flatnonzero(status == code).tolist()
                table.add_row(name.replace("_", " "), str(count), spans_text(which, len(which) if whole else SPANS))
        parts.append(table)
    if COMPARED in content:
        parts.extend(_comparison(content[COMPARED]))
    facts = Table.grid(padding=(0, 2))
    if not some_without:
        facts.add_row(Text("percentiles", style="dim"), f"of all {of}")
    if content["options"]:
        facts.add_row(Text("options", style="dim"), ", ".join(f"{k} = {v}" for k, v in content["options"].items()))
    for name, m in content["metrics"].items():
        if "over" in m:
            text = f"{100.0 * m['over']['share']:.4g} % of {count_text(m['over']['of'], 'case')}"
            facts.add_row(Text(f"{name} over {m['over']['limit']:g}", style="dim"), text)
    if set(content["devices"]) - {"cpu"}:
        facts.add_row(Text("chunks on", style="dim"), ", ".join(f"{k}: {v}" for k, v in content["devices"].items()))
    seconds = ", ".join(f"{name.replace('_', ' ')} {value:.1f} s" for name, value in content["timing_s"].items())
    facts.add_row(Text("time", style="dim"), seconds)
    if content["cases_run"]:
        facts.add_row(Text("rate", style="dim"), f"{rate_text(content['cases_per_s'])}, compilation included")
    return Group(*parts, facts)


def _in_single(content: dict[str, Any]) -> str:
    return "" if content["precision"] == "float64" else f", in {content['precision']}"


def _comparison(compared: dict[str, Any]) -> list[RenderableType]:
    """How far cases in single precision are from the same in double."""
    table = plain_table("float32 off by", "50 %", "largest", "unit", "of", "% of spread", right=(1, 2, 4, 5))
    for name, m in compared["metrics"].items():
        share = f"{100.0 * m['median_over_spread']:.2g}"
        table.add_row(name, _text(m["median"]), _text(m["largest"]), unit_text(m["unit"]), str(m["of"]), share)
    return [Text(compared["message"], style="" if compared["holds"] else "bold red"), table]


def share_text(success: dict[str, Any]) -> str:
    """Returns the share that succeeded with the interval in which the true one is."""
    share, low, high = (100.0 * success[key] for key in ("share", "low", "high"))
    # As many digits as tell the ends apart.
    digits = min(max(0, 1 - math.floor(math.log10(max(high - low, 1e-6)))), 4)
    return f"{share:.{digits}f} % (95 % interval {low:.{digits}f} to {high:.{digits}f} %)"


def case_summary(content: dict[str, Any]) -> RenderableType:
    """Returns status and metrics of a single case."""
    ended = content["status"].replace("_", " ")
    header = Text.assemble((content["scenario"], "bold"), f": case {content['case']}, seed {content['seed']}: {ended}")
    table = plain_table("metric", "value", "unit", right=(1,))
    for name, m in content["metrics"].items():
        table.add_row(name, _text(m["value"]), unit_text(m["unit"]))
    return Group(header, table)


def _text(value: float | None) -> str:
    return "none" if value is None or not math.isfinite(value) else value_text(value, 4)
