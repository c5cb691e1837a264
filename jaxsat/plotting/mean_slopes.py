"""What a change of each knob does to the mean of each metric, with its error."""

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxsat.plotting.style import FAINT, INK, LEFT_OUT, MAIN, QUIET, bar_panels, dress, head

FAINT_BAR = "#b9c7d6"
ROW_IN, HEAD_IN = 0.24, 0.78
SEEN = 3.0
"""Errors from which on an effect has the full colour."""


def draw_slopes(metrics: Mapping[str, Mapping[str, Any]], *, title: str, subtitle: str = "") -> Figure:
    """Returns a bar for each knob in a panel for each metric, which are those of `slopes.json`."""
    knobs = max((len(one["slopes"]) for one in metrics.values()), default=1)
    figure, places = bar_panels(
        title,
        subtitle,
        len(metrics),
        bars=knobs,
        row_in=ROW_IN,
        head_in=HEAD_IN,
        bottom_in=0.5,
        left=0.19,
        wspace=0.5,
    )
    for axes, (name, metric) in zip(places, metrics.items(), strict=True):
        _draw(axes, name, metric)
    return figure


def _draw(axes: Axes, name: str, metric: Mapping[str, Any]) -> None:
    dress(axes)
    head(axes, name)
    mean = metric["mean"]
    if mean is not None:
        # Its unit stands in the name.
        head(axes, f"mean {mean:.4g}", side="right", fontsize=8, color=QUIET)
    slopes = metric["slopes"]
    for place, one in enumerate(slopes.values()):
        value, sigma = one["effect"]["value"], one["effect"]["sigma"]
        if value is None:
            continue
        seen = sigma is not None and abs(value) >= SEEN * sigma and value != 0.0
        axes.barh(place, value, 0.62, color=MAIN if seen else FAINT_BAR, linewidth=0)
        if sigma is not None:
            axes.plot([value - sigma, value + sigma], [place, place], color=INK, linewidth=1.0)
        exact = one.get("exact")
        if exact is not None and exact["effect"] is not None:
            axes.plot(exact["effect"], place, "o", color=LEFT_OUT, markersize=3.5)
    axes.axvline(0.0, color=FAINT, linewidth=0.8)
    labels = [f"{own} {one['effect']['of']}" for own, one in slopes.items()]
    axes.set_yticks(range(len(slopes)), labels, fontsize=7.5)
    axes.set_ylim(len(slopes) - 0.4, -0.6)
    axes.locator_params(axis="x", nbins=5)
    if any("exact" in one for one in slopes.values()):
        axes.set_xlabel("dots: exact derivatives", fontsize=7.5, color=LEFT_OUT, labelpad=1)
