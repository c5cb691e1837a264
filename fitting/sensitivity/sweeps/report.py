"""The indices of a finished sweep: indices.json, a picture, and rows for a terminal."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from fitting.sensitivity.sweeps.indices import FEWEST, MOST, OutputIndices, dependences, sobol_indices
from fitting.sensitivity.sweeps.table import SUCCESS, SweepTable, read_sweep, regrouped
from jaxsat.errors import InputError
from jaxsat.files.json_files import plain, write_json
from jaxsat.files.staging import staged_directory
from jaxsat.significant import count_text

SCHEMA = "jaxsat.indices/1"
FILES = ("indices.json", "indices.png")
HEAD = ("metric", "input", "first", "95 %", "total", "95 %")
"""Of the rows for a terminal."""
SHOWN = 0.02
"""Smaller indices are left to the file."""


def write_sweep_indices(
    directory: Path,
    out: Path,
    *,
    together: Sequence[Sequence[str]] = (),
    apart: Sequence[str] = (),
    plots: bool = True,
    progress: Callable[[str], None] = lambda said: None,
) -> tuple[dict[str, Any], list[tuple[str, ...]], list[str]]:
    """Writes indices.json and indices.png of the sweep in `directory` into `out`.

    Returns the document, rows of a table under `HEAD`, and sentences that belong beneath it. Raises `InputError`, one
    line, where the directory holds no finished sweep that keeps its inputs, or too few cases. `progress` is told of
    each metric before it is begun. Inputs that are `together` count as one, as those that depend on each other
    must; of those that are `apart` each column counts by itself, as it may where they are independent.
    """
    table = regrouped(read_sweep(directory), together, apart)
    if table.cases < FEWEST:
        again = f"jaxsat sweep {table.scenario} --out {directory} --cases {10 * FEWEST} --resume"
        raise InputError(f"holds {count_text(table.cases, 'case')}; {FEWEST} are needed: `{again}`", file=directory)
    began = time.perf_counter()
    found = {}
    inputs = {name: one.values for name, one in table.inputs.items()}
    names = {name: one.columns for name, one in table.inputs.items()}
    for name, metric in table.metrics.items():
        progress(name)
        found[name] = sobol_indices(inputs, metric.values, names=names)
    document = _document(table, found)
    document["timing_s"] = {"total": time.perf_counter() - began}
    with staged_directory(out, FILES) as stage:
        if plots:
            from jaxsat.plotting import png_bytes
            from jaxsat.plotting.sweep_indices import draw_indices

            shown = {name: one for name, one in plain(document)[0]["metrics"].items() if one["indices"]}
            subtitle = f"{count_text(table.cases, 'case')}, seed {table.seed}; lines are 95 % intervals"
            picture = draw_indices(shown, title=f"What drives {table.scenario}", subtitle=subtitle)
            (stage / "indices.png").write_bytes(png_bytes(picture))
        document = plain(document)[0]
        write_json(stage / "indices.json", document)
    return document, table_rows(document), sentences(document)


def _document(table: SweepTable, found: dict[str, OutputIndices]) -> dict[str, Any]:
    dependent = dependences({name: one.values for name, one in table.inputs.items()})
    return {
        "schema": SCHEMA,
        "scenario": table.scenario,
        "seed": table.seed,
        "options": table.options,
        "cases": table.cases,
        "failed": table.failed,
        "inputs": {
            name: {"unit": one.unit, "meaning": one.meaning, "columns": list(one.columns)}
            for name, one in table.inputs.items()
        },
        "dependent": [{"inputs": list(one.inputs), "rank_correlation": one.correlation} for one in dependent],
        "metrics": {name: _told(table, name, one) for name, one in found.items()},
    }


def _told(table: SweepTable, name: str, found: OutputIndices) -> dict[str, Any]:
    metric = table.metrics[name]
    without = int(np.sum(~np.isfinite(metric.values)))
    remarks = list(found.remarks)
    if without and found.inputs:
        remarks.append(f"of the {1.0 - without / table.cases:.1%} of the cases that have it")
    if found.cases == MOST:
        remarks.append(f"of the first {MOST} cases that have it")
    return {
        "unit": metric.unit,
        "meaning": metric.meaning,
        "cases": found.cases,
        "without": without,
        "mean": found.mean,
        "sigma": found.sigma,
        "foretold": found.foretold,
        "unresolved": found.unresolved,
        "remarks": remarks,
        "indices": {
            own: {
                "first": asdict(one.first),
                "total": asdict(one.total),
                "bound": one.bound,
                "columns": {
                    column: {"slope": slope, "slope_sigma": sigma, "steepness": one.steepness[column]}
                    for column, (slope, sigma) in one.slopes.items()
                },
            }
            for own, one in found.inputs.items()
        },
    }


def table_rows(document: dict[str, Any]) -> list[tuple[str, ...]]:
    """Rows under `HEAD`: of each metric the inputs that are seen to matter, those that matter most first."""
    rows = []
    for name, metric in document["metrics"].items():
        indices = metric["indices"]
        order = sorted(indices, key=lambda own: -_size(indices[own]))
        shown = [own for k, own in enumerate(order) if k == 0 or _size(indices[own]) > SHOWN]
        for place, own in enumerate(shown):
            first, total = indices[own]["first"], indices[own]["total"]
            rows.append(("" if place else name, own, *_estimate(first), *_estimate(total)))
        rest = [own for own in order if own not in shown]
        if rest:
            highest = max(indices[own]["total"]["high"] for own in rest)
            label = ", ".join(rest) if len(rest) < 3 else count_text(len(rest), "other")
            rows.append(("", label, "", "", "", f"up to {highest:.2f}"))
    return rows


def _size(one: dict[str, Any]) -> float:
    """How much an input is seen to matter: its total index, or the lower end where that is all that is known."""
    total = one["total"]["low"] if one["total"]["value"] is None else one["total"]["value"]
    return max(one["first"]["low"], total)


def _estimate(one: dict[str, Any]) -> tuple[str, str]:
    value = "" if one["value"] is None else f"{one['value']:z.2f}"
    return value, f"{one['low']:z.2f} to {one['high']:z.2f}"


def sentences(document: dict[str, Any]) -> list[str]:
    """What has to be said beside the indices: inputs that depend, metrics and cases without, what is unresolved."""
    said = []
    for pair in document["dependent"]:
        a, b = pair["inputs"]
        said.append(
            f"{a} and {b} depend on each other (rank correlation {pair['rank_correlation']:.2f}): an index of either "
            "has part of the other in it"
        )
    for name, metric in document["metrics"].items():
        if name == SUCCESS and not document["failed"]:
            said.append("success: all cases succeeded")
        else:
            said += [f"{name}: {remark}" for remark in metric["remarks"]]
    dim = [f"{name} {one['unresolved']:.0%}" for name, one in document["metrics"].items() if _dim(one)]
    if dim:
        said.append(f"unresolved, which widens total indices: {', '.join(dim)}; more cases resolve more")
    return said


def _dim(metric: dict[str, Any]) -> bool:
    return bool(metric["indices"]) and (metric["unresolved"] or 0.0) > 0.1
