"""The files of a single case of a sweep: case.json, history.csv and history.png."""

import csv
import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.cli.shared.terminal import show
from jaxsat.cli.sweep.files import case_summary
from jaxsat.errors import InputError
from jaxsat.files.json_files import plain, write_json
from jaxsat.files.staging import staged_directory
from jaxsat.sweep import Factory, Scenario, SweepPlan, read_plan, run_cases

SCHEMA = "jaxsat.sweep-case/1"
FILES = ("history.csv", "history.png", "search.html", "case.json")
"""All names that a case may have; a scenario's replay may add others."""


Replay = Callable[[Mapping[str, str], int, int, Path], None]
"""Writes the files of a case from all options, the seed, the case's number and the directory."""


def with_replay(factory: Factory, replay: Replay) -> Factory:
    """Returns the factory of the same scenarios, whose cases can be replayed."""

    def build(options: Mapping[str, str]) -> Scenario:
        return dataclasses.replace(factory(options), replay=functools.partial(replay, options))

    return dataclasses.replace(factory, build=build)


def write_history(
    directory: Path,
    t_s: np.ndarray,
    columns: Mapping[str, np.ndarray],
    panels: Mapping[str, Mapping[str, np.ndarray]],
    *,
    title: str,
    subtitle: str = "",
) -> None:
    """Writes history.csv with `columns` [time], units in their names, and history.png with `panels`.

    The latter are those of `jaxsat.plotting.history.draw_history`.
    """
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.history import draw_history

    with (directory / "history.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["t_s", *columns])
        rows = np.column_stack([t_s, *columns.values()]).tolist()
        writer.writerows([f"{x:.10g}" if math.isfinite(x) else "" for x in row] for row in rows)
    figure = draw_history(t_s, panels, title=title, subtitle=subtitle)
    (directory / "history.png").write_bytes(png_bytes(figure))


def case_document(scenario: Scenario, seed: int, case: int, options: Mapping[str, str]) -> dict[str, Any]:
    """Runs the chunk of a case and returns the content of case.json: the very numbers that a sweep has of it."""
    own = case % scenario.chunk
    found = run_cases(scenario, seed, case - own + np.arange(scenario.chunk, dtype=np.int64))
    return {
        "schema": SCHEMA,
        "scenario": scenario.name,
        "seed": seed,
        "options": dict(options),
        "case": case,
        "status": scenario.statuses[found["status"][own]],
        "metrics": {
            name: {"value": float(found[name][own]), "unit": metric.unit} for name, metric in scenario.metrics.items()
        },
    }


def write_case(scenario: Scenario, plan: SweepPlan, out: Path, case: int) -> int:
    """Runs one case, writes its files into out/case-K and prints its metrics; returns the exit status."""
    stored = read_plan(out)
    difference = "" if stored is None else stored.difference(plan)
    if difference:
        raise InputError(f"holds a sweep with {difference}; take another --out", file=out)
    directory = out / f"case-{case}"
    with staged_directory(directory, FILES) as stage:
        content = case_document(scenario, plan.seed, case, plan.options)
        if scenario.replay is not None:
            scenario.replay(plan.seed, case, stage)
        write_json(stage / "case.json", plain(content)[0])
    show(case_summary(content), f"\nresults in {directory}")
    return 0
