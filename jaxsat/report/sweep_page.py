"""The page of a sweep: how many cases succeeded, every outcome's distribution, what came of what was drawn, failures.

The numbers that can be looked at one by one are those of some thousand cases at most, so that the page of a hundred
thousand cases is no larger: as many failures as there is room for, and every so manyth of the rest. Histograms and
percentiles are always those of all cases.
"""

import base64
import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from jaxsat.report.html import page
from jaxsat.report.sections import Facts, Folded, Live, Picture, Remarks, Section, Table
from jaxsat.significant import count_text, spans_text, unit_text, value_text
from jaxsat.sweep.names import title_of_input, title_of_scenario
from jaxsat.sweep.scenario import Scenario
from jaxsat.sweep.summary import MetricSummary

SHOWN, FAILED = 4000, 1000
"""Cases whose numbers the page has, and how many of them may be failures."""
SPANS = 12


def sweep_page(
    scenario: Scenario,
    summary: Mapping[str, Any],
    status: np.ndarray,
    metrics: Sequence[MetricSummary],
    column: Callable[[str], np.ndarray],
    *,
    command: Sequence[str],
    success: str,
    png: bytes | None = None,
) -> str:
    """Returns the page as HTML; `summary` is the content of summary.json, `column(name)` a column [cases] of the table.

    `command` are the words of a command that, with a case's number behind it, shows that case; `success` is a sentence
    on the share that succeeded; `png` is the picture of the distributions for whoever has no script.
    """
    cases, failed = summary["cases"], summary["cases"] - summary["succeeded"]
    compared = summary.get("compared_with_float64")
    spoilt = compared is not None and not compared["holds"]
    title = f"{title_of_scenario(scenario.name)}: {_thousands(cases)} cases"
    options = ", ".join(f"{name} = {value}" for name, value in summary["options"].items())
    words = shlex.join(command)
    chosen = chosen_cases(status)
    picture = None if png is None else Picture("Outcomes", png, "a histogram of each outcome")
    sections: list[Section] = [
        Live("distributions", "Outcomes", picture),
        Live("scatter", "What came of what"),
        Live("failures", "Cases that failed" if failed else "Cases"),
        _percentiles(metrics),
        Remarks("What the percentiles leave out", _left_out(metrics)),
        _failures(scenario, status, words),
        *([] if compared is None else [_comparison(compared, metrics)]),
        Remarks("Assumed", scenario.assumptions),
        Folded(Facts("Options", [(name, str(value)) for name, value in summary["options"].items()])),
        Facts("Drawn for each case", [_drawn(one) for one in scenario.inputs]),
    ]
    return page(
        title,
        subtitle=", ".join(
            filter(
                None, [f"seed {summary['seed']}", "" if compared is None else "float32", options and "options below"]
            )
        ),
        verdict="bad" if failed == cases or spoilt else "doubtful" if failed else "good",
        verdict_text=f"{_thousands(summary['succeeded'])} of {_thousands(cases)} cases succeeded"
        f"{', in a precision that is not good enough' if spoilt else ''}.",
        message=" ".join([success, _reasons(summary, failed), *([] if compared is None else [compared["message"]])]),
        sections=sections,
        data=_data(scenario, summary, status, metrics, column, chosen, words),
        script="sweep",
    )


def chosen_cases(status: np.ndarray) -> np.ndarray:
    """Numbers of the cases whose numbers the page has, in order: spread evenly over those that failed and the rest."""
    if len(status) <= SHOWN:
        return np.arange(len(status))
    bad, good = np.flatnonzero(status), np.flatnonzero(status == 0)
    bad = _evenly(bad, min(len(bad), max(FAILED, SHOWN - len(good))))
    return np.sort(np.concatenate([bad, _evenly(good, min(len(good), SHOWN - len(bad)))]))


def _evenly(numbers: np.ndarray, count: int) -> np.ndarray:
    return numbers[np.arange(count) * len(numbers) // max(count, 1)]


def _reasons(summary: Mapping[str, Any], failed: int) -> str:
    if not failed:
        return "None failed."
    parts = [
        f"{_thousands(count)} {name.replace('_', ' ')}"
        for name, count in list(summary["statuses"].items())[1:]
        if count
    ]
    return f"{_thousands(failed)} failed: {', '.join(parts)}."


def _left_out(metrics: Sequence[MetricSummary]) -> list[str]:
    """Of each outcome that some cases do not have."""
    return [
        f"{m.title}: {count_text(m.missing, 'case')} of {_thousands(m.cases + m.missing)} without it, so that its "
        f"percentiles are those of the {_thousands(m.cases)} others."
        for m in metrics
        if m.missing
    ]


def _percentiles(metrics: Sequence[MetricSummary]) -> Table:
    rows = []
    for m in metrics:
        numbers = (_text(m.shown(key)) for key in ("p05", "p50", "p95", "max"))
        rows.append((m.title, *numbers, unit_text(m.unit), _thousands(m.cases), _sentence(m.meaning)))
        if m.missing and m.all_cases is not None:
            numbers = (_text(m.all_cases[key]) for key in ("p05", "p50", "p95"))
            every = _thousands(m.cases + m.missing)
            rows.append(("of all cases", *numbers, "never", unit_text(m.unit), every, "where never counts as beyond"))
        if m.over is not None:
            share = f"{100.0 * m.over['share']:.4g} %"
            text = f"of all cases are over {m.over['limit']:g} {unit_text(m.unit)}"
            rows.append(("over the limit", "", share, "", "", "", _thousands(m.cases + m.missing), text))
    columns = ("outcome", "5 %", "50 %", "95 %", "largest", "unit", "of cases", "meaning")
    return Table("Percentiles", columns, rows, (1, 2, 3, 4, 6))


def _failures(scenario: Scenario, status: np.ndarray, words: str) -> Table:
    """Which cases failed in which way, for whoever has no script."""
    rows = []
    for code, name in enumerate(scenario.statuses):
        which = np.flatnonzero(status == code).tolist() if code else []
        if which:
            rows.append((name.replace("_", " "), _thousands(len(which)), spans_text(which, SPANS)))
    return Table("Why cases failed", ("because", "cases", "which"), rows, (1,), note=f"To look at one: {words} NUMBER")


def _comparison(compared: Mapping[str, Any], metrics: Sequence[MetricSummary]) -> Table:
    """How far cases in single precision are from the same cases in double."""
    titles, rows = {m.name: m.title for m in metrics}, []
    for name, m in compared["metrics"].items():
        shares = [f"{100.0 * m[key]:.2g} %" for key in ("median_over_spread", "percentiles_over_spread")]
        numbers = (_text(math.nan if m[key] is None else m[key]) for key in ("median", "largest"))
        rows.append((titles[name], *numbers, unit_text(m["unit"]), *shares, _thousands(m["of"])))
    columns = ("outcome", "median", "largest", "unit", "median of spread", "percentiles moved", "of cases")
    return Table("Single precision: how far from double", columns, rows, (1, 2, 4, 5, 6), note=compared["message"])


def _drawn(one) -> tuple[str, str]:
    name = title_of_input(one, one.columns[0]) if not one.parts else one.name.replace("_", " ").capitalize()
    unit = unit_text(one.unit)
    return name + (f", {unit}" if unit else ""), _sentence(one.meaning)


def _data(scenario, summary, status, metrics, column, chosen, words) -> dict[str, Any]:
    """What the script draws from; columns of the chosen cases as base64 of little-endian float32."""
    outcomes = [
        {
            "name": m.name,
            "title": m.title,
            "unit": unit_text(m.unit),
            "meaning": _sentence(m.meaning),
            "cases": m.cases,
            "missing": m.missing,
            "beyond": m.beyond,
            "marks": [_number(m.shown(key)) for key in ("p05", "p50", "p95")],
            "edges": [float(f"{edge:.6g}") for edge in m.edges],
            "logarithmic": m.logarithmic,
            "whole": m.whole,
            "succeeded": m.succeeded.tolist(),
            "failed": m.failed.tolist(),
            "values": _packed(column(m.name)[chosen]),
        }
        for m in metrics
    ]
    inputs = [
        {
            "name": name,
            "title": title_of_input(one, name),
            "unit": unit_text(one.unit),
            "meaning": _sentence(one.meaning),
            "values": _packed(column(name)[chosen]),
        }
        for one in scenario.inputs
        for name in one.columns
    ]
    return {
        "across": _telling(scenario, status, metrics, column, chosen),
        "cases": summary["cases"],
        "failed": summary["cases"] - summary["succeeded"],
        "failed_shown": int(np.count_nonzero(status[chosen])),
        "statuses": [name.replace("_", " ") for name in scenario.statuses],
        "counts": list(summary["statuses"].values()),
        "replay": words,
        "case": chosen.tolist(),
        "status": status[chosen].tolist(),
        "outcomes": outcomes,
        "inputs": inputs,
    }


def _telling(scenario, status, metrics, column, chosen) -> str | None:
    """The drawn column that goes along with failure, or with the first outcome where none failed, the most.

    By the correlation of ranks, of the value or of how far it is from the middle; only what is shown at first.
    """
    if not metrics:
        return None
    wanted = (status != 0).astype(float) if np.any(status) else column(metrics[0].name)
    wanted = wanted[chosen]
    best, most = None, -1.0
    for name in scenario.input_columns:
        values = column(name)[chosen]
        for tried in (values, np.abs(values - np.median(values))):
            both = np.isfinite(wanted) & np.isfinite(tried)
            a, b = _ranks(tried[both]), _ranks(wanted[both])
            told = abs(np.corrcoef(a, b)[0, 1]) if len(a) > 2 and np.ptp(a) > 0.0 and np.ptp(b) > 0.0 else 0.0
            if told > most:
                best, most = name, told
    return best


def _ranks(values: np.ndarray) -> np.ndarray:
    """Equal values have the mean of their places."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - 0.5 * counts)[place]


def _packed(values: np.ndarray) -> str:
    return base64.b64encode(np.asarray(values, "<f4").tobytes()).decode("ascii")


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None


def _text(value: float) -> str:
    return value_text(value, 4) if np.isfinite(value) else "never" if value > 0.0 else "none"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _thousands(count: int) -> str:
    return f"{count:,}".replace(",", "\u202f")
