"""Slopes of means as slopes.json, a picture, a page, and rows and sentences for a terminal."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fitting.sensitivity.means.of_scenario import SUCCESS, MetricSlopes, ScenarioSlopes
from fitting.sensitivity.means.page import slopes_page
from jaxsat.files.json_files import plain, write_json
from jaxsat.significant import count_text, unit_text, value_and_sigma, value_text
from jaxsat.sweep.names import title_of_scenario
from jaxsat.sweep.scenario import as_numbers

SCHEMA = "jaxsat.slopes/1"
FILES = ("slopes.json", "slopes.png", "report.html")
SEEN = 3.0
"""Errors from which on an effect is shown on a terminal."""
BENT = 0.1
"""Share of a slope that the width may be to blame for."""


def write_slopes(
    stage: Path, found: ScenarioSlopes, options: Mapping[str, str], *, plots: bool = True
) -> dict[str, Any]:
    """Writes slopes.json, report.html and, with `plots`, slopes.png into an empty directory; returns the document.

    `options` are those that the scenario was made with.
    """
    document = plain(slopes_document(found, options))[0]
    said, subtitle = sentences(document), subtitle_of(document)
    png = None
    if plots:
        # Matplotlib is wanted here for the first time.
        from jaxsat.plotting.mean_slopes import draw_slopes
        from jaxsat.plotting.style import png_bytes

        title = f"{title_of_scenario(found.scenario.name)}: effects on means"
        png = png_bytes(draw_slopes(document["metrics"], title=title, subtitle=subtitle))
        (stage / "slopes.png").write_bytes(png)
    (stage / "report.html").write_text(slopes_page(document, said, subtitle, png), encoding="utf-8")
    write_json(stage / "slopes.json", document)
    return document


def subtitle_of(document: Mapping[str, Any]) -> str:
    """Of how many cases, and how they were moved."""
    share = f"{100.0 * document['width']:g} %"
    how = f"all knobs moved at once, 1-sigma {share}" if document["together"] else f"each knob moved alone by ± {share}"
    return f"{count_text(document['cases'], 'case')}, seed {document['seed']}; {how}; lines are 1-sigma"


def slopes_document(found: ScenarioSlopes, options: Mapping[str, str]) -> dict[str, Any]:
    """Content of slopes.json."""
    scenario = found.scenario
    return {
        "schema": SCHEMA,
        "scenario": scenario.name,
        "options": as_numbers(options),
        "assumptions": list(scenario.assumptions),
        "cases": found.cases,
        "seed": found.seed,
        "width": found.width,
        "together": found.together,
        "ended": found.ended,
        "knobs": {
            knob.name: {
                "unit": knob.unit,
                "meaning": knob.meaning,
                "value": knob.value,
                "moved_by": "factor" if knob.shift is None else "sum",
                "move": 1.0 if knob.shift is None else knob.shift,
            }
            for knob in found.knobs
        },
        "metrics": {name: _metric(found, one) for name, one in found.metrics.items()},
        "timing_s": {"total": found.seconds},
    }


def _metric(found: ScenarioSlopes, one: MetricSlopes) -> dict[str, Any]:
    return {
        "unit": one.metric.unit,
        "meaning": one.metric.meaning,
        "mean": one.mean,
        "mean_sigma": one.mean_sigma,
        "smoothed_mean": one.slopes.mean,
        "smoothed_mean_sigma": one.slopes.mean_sigma,
        "without": one.without,
        "counted_as": one.horizon_s,
        "slopes": {knob.name: _slope(one, k, knob) for k, knob in enumerate(found.knobs)},
    }


def _slope(one: MetricSlopes, k: int, knob) -> dict[str, Any]:
    by, name = knob.per
    value, sigma = float(one.slopes.slopes[k]) + 0.0, float(one.slopes.sigma[k])
    own = {
        "slope": value,
        "sigma": sigma,
        "left_out": int(one.slopes.left_out[k]),
        "effect": {"of": name, "value": by * value, "sigma": by * sigma},
    }
    if one.exact is not None:
        exact = one.exact
        own["exact"] = {
            "slope": float(exact.slopes[k]),
            "sigma": float(exact.sigma[k]),
            "left_out": int(exact.left_out[k]),
            "apart": float(exact.apart[k]),
            "apart_sigma": float(exact.apart_sigma[k]),
            "effect": by * float(exact.slopes[k]),
        }
    return own


def head_of(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Columns of the rows for a terminal."""
    return ("metric", "mean", "by +1 % of", "effect", *(["exact"] if _has_exact(document) else []))


def _has_exact(document: Mapping[str, Any]) -> bool:
    return any("exact" in one for metric in document["metrics"].values() for one in metric["slopes"].values())


def table_rows(document: Mapping[str, Any], *, whole: bool = False) -> list[tuple[str, ...]]:
    """Rows under `head_of`: of each metric the knobs that are seen to matter, or the `whole` of them."""
    rows, exact = [], _has_exact(document)
    for name, metric in document["metrics"].items():
        slopes = metric["slopes"]
        order = sorted(slopes, key=lambda own: -_certainty(slopes[own]))
        shown = [own for own in order if whole or _certainty(slopes[own]) >= SEEN]
        first = (name, pm_text(metric["mean"], metric["mean_sigma"]))
        for own in shown:
            one = slopes[own]
            effect = one["effect"]
            beside = [value_text(one["exact"]["effect"], 3) if "exact" in one else ""] if exact else []
            label = own if effect["of"] == "+1 %" else f"{own}, {effect['of']}"
            rows.append((*first, label, pm_text(effect["value"], effect["sigma"]), *beside))
            first = ("", "")
        rest = len(order) - len(shown)
        if rest:
            label = (
                next(own for own in order if own not in shown) if rest == 1 else f"{rest} others" if shown else "any"
            )
            rows.append((*first, label, f"< {SEEN:g}\u03c3", *([""] if exact else [])))
    return rows


def pm_text(value: float | None, sigma: float | None) -> str:
    """A number with its error."""
    number, error = value_and_sigma(value, sigma)
    return f"{number} ± {error}" if error else number


def _certainty(one: Mapping[str, Any]) -> float:
    if one["slope"] is None or not one["sigma"]:
        return 0.0 if not one["slope"] else np.inf
    return abs(one["slope"]) / one["sigma"]


def sentences(document: Mapping[str, Any]) -> list[str]:
    """What has to be said beside the slopes: how cases ended, what counts as what, what is left out or is not so."""
    said = []
    ended = [f"{count} {name.replace('_', ' ')}" for name, count in document["ended"].items()]
    said.append(f"of {count_text(document['cases'], 'case')} {', '.join(ended)}")
    for name, metric in document["metrics"].items():
        said += _of_metric(name, metric)
    off = [name for name, metric in document["metrics"].items() if _exact_is_none(metric)]
    if off:
        said.append(f"cases jump or are chaotic, and exact derivatives are not those of the mean: {', '.join(off)}")
    return said


def _of_metric(name: str, metric: Mapping[str, Any]) -> list[str]:
    said = []
    without = sum(metric["without"].values())
    why = ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in metric["without"].items())
    if metric["counted_as"] is not None and without:
        until = f"{value_text(metric['counted_as'], 4)} {unit_text(metric['unit'])}"
        said.append(f"{name}: {count_text(without, 'case')} without it count as {until}, all that was simulated")
    elif without:
        said.append(f"{name}: {count_text(without, 'case')} without it ({why}); the mean is that of the others")
    most = max((one["left_out"] for one in metric["slopes"].values()), default=0)
    if most:
        said.append(f"{name}: up to {count_text(most, 'case')} without it on one side or both are in no slope")
    blank = [own for own, one in metric["slopes"].items() if one["slope"] is None]
    if blank:
        said.append(f"{name}: too few cases have it for a slope by {', '.join(blank)}")
    if name == SUCCESS and metric["mean"] in (0.0, 1.0) and not any(one["slope"] for one in metric["slopes"].values()):
        said.append(f"{name}: the same in all runs; its errors are as if a case had differed")
    return said


def _exact_is_none(metric: Mapping[str, Any]) -> bool:
    """Whether exact derivatives are seen not to be those of the mean."""
    own = [one["exact"] for one in metric["slopes"].values() if "exact" in one]
    return any(one["apart"] is not None and _apart(one) for one in own)


def _apart(exact: Mapping[str, Any]) -> bool:
    """Whether the mean of exact derivatives is farther from the slope than sample and width can be to blame for."""
    off, size = abs(exact["apart"]), max(abs(exact["slope"]), abs(exact["slope"] + exact["apart"]))
    return off > SEEN * exact["apart_sigma"] and off > BENT * size
