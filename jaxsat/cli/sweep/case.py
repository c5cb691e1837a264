"""The files of a single case of a sweep: case.json, and of its history history.csv, history.png and a page."""

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.cli.shared.talk import Talk
from jaxsat.cli.sweep.files import case_summary
from jaxsat.errors import InputError
from jaxsat.files.json_files import plain, write_json
from jaxsat.files.staging import staged_directory
from jaxsat.numerics import Precision
from jaxsat.sweep import History, Page, Scenario, SweepPlan, chunk_of, drawn_inputs, read_plan, run_cases
from jaxsat.sweep.names import title_of_scenario
from jaxsat.sweep.scenario import as_numbers

SCHEMA = "jaxsat.sweep-case/1"
FILES = ("history.csv", "history.png", "search.html", "case.json")
"""All names that a case may have."""


def write_history(directory: Path, history: History, scenario: Scenario, *, seed: int, case: int) -> None:
    """Writes history.csv, history.png and, where the history has a page, that."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.history import draw_history

    with (directory / "history.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["t_s", *history.columns])
        rows = np.column_stack([history.t_s, *history.columns.values()]).tolist()
        writer.writerows([f"{x:.10g}" if math.isfinite(x) else "" for x in row] for row in rows)
    title = f"{title_of_scenario(scenario.name)}, case {case}"
    subtitle = ", ".join(filter(None, [f"seed {seed}", history.remark]))
    png = png_bytes(draw_history(history.t_s, history.charts, title=title, subtitle=subtitle))
    (directory / "history.png").write_bytes(png)
    if history.page is not None:
        text = case_page(history.page, png, scenario.assumptions, title=title, subtitle=subtitle)
        (directory / f"{history.page.script}.html").write_text(text, encoding="utf-8")


def case_page(shown: Page, png: bytes, assumptions: Sequence[str], *, title: str, subtitle: str) -> str:
    """Returns the page of a case; `png` is its picture for whoever has no script."""
    from jaxsat.report import Live, Picture, Remarks, page

    picture = Picture(title, png, shown.alternative)
    return page(
        title,
        subtitle=subtitle,
        verdict="good" if shown.good else "bad",
        verdict_text=shown.verdict,
        message=shown.message,
        sections=[Live(shown.script, shown.heading, picture), Remarks("Assumed", assumptions)],
        data=shown.data,
        script=shown.script,
    )


def case_document(
    scenario: Scenario, seed: int, case: int, options: Mapping[str, str], precision: Precision = "float64"
) -> dict[str, Any]:
    """Runs the chunk of a case and returns the content of case.json: the very numbers that a sweep has of it."""
    own = case % scenario.chunk
    cases = chunk_of(case, scenario.chunk)
    found, drawn = run_cases(scenario, seed, cases), drawn_inputs(scenario, seed, cases)
    return {
        "schema": SCHEMA,
        "scenario": scenario.name,
        "seed": seed,
        "precision": precision,
        "options": as_numbers(options),
        "assumptions": list(scenario.assumptions),
        "case": case,
        "status": scenario.statuses[found["status"][own]],
        "metrics": {
            name: {"value": float(found[name][own]), "unit": metric.unit} for name, metric in scenario.metrics.items()
        },
        "inputs": {
            name: {"value": float(drawn[name][own]), "unit": one.unit}
            for one in scenario.inputs
            for name in one.columns
        },
    }


def write_case(scenario: Scenario, plan: SweepPlan, out: Path, case: int, talk: Talk) -> int:
    """Runs one case, writes its files into out/case-K and says its metrics; returns the exit status."""
    stored = read_plan(out)
    difference = "" if stored is None else stored.difference(plan)
    if difference:
        raise InputError(f"holds a sweep with {difference}; take another --out", file=out)
    directory = out / f"case-{case}"
    with talk.stages(f"{scenario.name}, case {case}") as progress, staged_directory(directory, FILES) as stage:
        progress("running its chunk")
        content = case_document(scenario, plan.seed, case, plan.options, plan.precision)
        if scenario.history is not None:
            progress("its history")
            write_history(stage, scenario.history(plan.seed, case), scenario, seed=plan.seed, case=case)
        write_json(stage / "case.json", plain(content)[0])
    talk.result(case_summary(content), f"\nresults in {directory}", document=directory / "case.json")
    return 0
