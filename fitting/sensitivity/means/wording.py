"""Slopes of means in words and in rows for a terminal, from what slopes.json has."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxsat.significant import count_text, unit_text, value_and_sigma, value_text

SUCCESS = "success"
"""Name of the metric that is 1 for a case that succeeded and 0 for one that did not: its mean is their share."""
SEEN = 3.0
"""Errors from which on an effect is shown on a terminal."""
BENT = 0.1
"""Share of a slope that the width may be to blame for."""


def subtitle_of(document: Mapping[str, Any]) -> str:
    """Of how many cases, and how they were moved."""
    share = f"{100.0 * document['width']:g} %"
    how = f"all knobs moved at once, 1-sigma {share}" if document["together"] else f"each knob moved alone by ± {share}"
    return f"{count_text(document['cases'], 'case')}, seed {document['seed']}; {how}; lines are 1-sigma"


def head_of(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Columns of the rows for a terminal."""
    return ("mean, and by +1 % of", "", "% of the mean", *(["exact"] if _has_exact(document) else []))


def _has_exact(document: Mapping[str, Any]) -> bool:
    return any("exact" in one for metric in document["metrics"].values() for one in metric["slopes"].values())


def table_rows(document: Mapping[str, Any], *, whole: bool = False) -> list[tuple[str, ...]]:
    """Rows under `head_of`: of each metric its mean, and the effects that are seen, or the `whole` of them."""
    rows, exact = [], _has_exact(document)
    for name, metric in document["metrics"].items():
        slopes = metric["slopes"]
        rows.append((name, pm_text(metric["mean"], metric["mean_sigma"]), "", *([""] if exact else [])))
        order = sorted(slopes, key=lambda own, slopes=slopes: -abs(slopes[own]["effect"]["value"] or 0.0))
        shown = [own for own in order if whole or _certainty(slopes[own]) >= SEEN]
        for own in shown:
            one = slopes[own]
            effect = one["effect"]
            beside = [value_text(one["exact"]["effect"], 3) if "exact" in one else ""] if exact else []
            label = own if effect["of"] == "+1 %" else f"{own}, {effect['of']}"
            rows.append((f"  {label}", pm_text(effect["value"], effect["sigma"]), share_text(metric, effect), *beside))
        rest = [own for own in order if own not in shown]
        if rest:
            label = rest[0] if len(rest) == 1 else f"{len(rest)} others" if shown else "any"
            rows.append((f"  {label}", f"< {SEEN:g}σ", "", *([""] if exact else [])))
    return rows


def share_text(metric: Mapping[str, Any], effect: Mapping[str, Any]) -> str:
    """An effect over the mean, in percent."""
    if not metric["mean"] or effect["value"] is None:
        return ""
    return f"{100.0 * effect['value'] / abs(metric['mean']):z.3f}"


def pm_text(value: float | None, sigma: float | None) -> str:
    """A number with its error; of small ones the power of ten stands outside."""
    if value is not None and sigma and max(abs(value), sigma) < 1e-3:
        power = math.floor(math.log10(max(abs(value), sigma)))
        number, error = value_and_sigma(value / 10.0**power, sigma / 10.0**power)
        return f"({number} ± {error})e{power}" if error else value_text(value)
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
