"""Slopes of means as slopes.json, a picture and a page."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting.sensitivity.means.of_scenario import MetricSlopes, ScenarioSlopes
from fitting.sensitivity.means.page import slopes_page
from fitting.sensitivity.means.wording import sentences, subtitle_of
from jaxsat.files.json_files import plain, write_json
from jaxsat.sweep.names import title_of_scenario
from jaxsat.sweep.scenario import as_numbers

SCHEMA = "jaxsat.slopes/1"
FILES = ("slopes.json", "slopes.png", "report.html")


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
        felt = {name: one for name, one in document["metrics"].items() if _felt(one)} or document["metrics"]
        png = png_bytes(draw_slopes(felt, title=title, subtitle=subtitle))
        (stage / "slopes.png").write_bytes(png)
    (stage / "report.html").write_text(slopes_page(document, said, subtitle, png), encoding="utf-8")
    write_json(stage / "slopes.json", document)
    return document


def _felt(metric: Mapping[str, Any]) -> bool:
    """Whether any knob does anything to it, but for rounding."""
    sizes = [abs(one["slope"]) for one in metric["slopes"].values() if one["slope"] is not None]
    return max(sizes, default=0.0) > 1e-9 * abs(metric["mean"] or 0.0)


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
        "succeeded": found.ended.get(scenario.statuses[0], 0),
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
