"""The page of slopes of means."""

from collections.abc import Mapping, Sequence
from typing import Any

from fitting.sensitivity.means.wording import share_text
from jaxsat.report import Facts, Picture, Remarks, Section, Table, page
from jaxsat.significant import unit_text, value_and_sigma, value_text
from jaxsat.sweep.names import title_of, title_of_scenario


def slopes_page(document: Mapping[str, Any], said: Sequence[str], subtitle: str, png: bytes | None) -> str:
    """Returns the HTML text of what slopes.json has; `said` are sentences that belong to it."""
    cases, good = document["cases"], document["succeeded"]
    knobs = [
        (f"{name}", f"{value_text(one['value'], 4)} {unit_text(one['unit'])}".strip() + f": {one['meaning']}")
        for name, one in document["knobs"].items()
    ]
    picture = [] if png is None else [Picture("Effects", png, "Effect of each knob on the mean of each metric")]
    sections: list[Section] = [
        Remarks("What to know", [f"{line}." for line in said]),
        *picture,
        *(_metric(name, one) for name, one in document["metrics"].items()),
        Facts("Knobs", knobs),
        Facts("Options", [(name, str(value)) for name, value in document["options"].items()]),
        Remarks("Assumed", document["assumptions"]),
    ]
    return page(
        f"{title_of_scenario(document['scenario'])}: what a change does on average",
        subtitle=subtitle,
        verdict="good" if good == cases else "doubtful" if good else "bad",
        verdict_text=f"{good} of {cases} cases succeeded as they are.",
        message=f"Slopes of {len(document['metrics'])} means by {len(document['knobs'])} knobs.",
        sections=sections,
    )


def _metric(name: str, metric: Mapping[str, Any]) -> Table:
    unit = unit_text(metric["unit"])
    rows = []
    for own, one in metric["slopes"].items():
        effect, exact = one["effect"], one.get("exact")
        value, sigma = value_and_sigma(effect["value"], effect["sigma"])
        beside = "" if exact is None else value_text(exact["effect"], 3)
        rows.append((own, effect["of"], value, sigma, share_text(metric, effect), beside, str(one["left_out"])))
    mean, error = value_and_sigma(metric["mean"], metric["mean_sigma"])
    heading = f"{title_of(name, metric['unit'])}: {mean}{f' ± {error}' if error else ''} {unit}".rstrip()
    columns = ("by", "change", f"effect, {unit}" if unit else "effect", "1σ", "% of the mean", "exact", "left out")
    return Table(
        heading, columns, rows, (2, 3, 4, 5, 6), note=f"{metric['meaning'][:1].upper()}{metric['meaning'][1:]}."
    )
