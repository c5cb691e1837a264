"""Which inputs of a sweep drive which metric: first-order and total indices with their intervals."""

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxsat.plotting.style import FAINT, INK, MAIN, QUIET, bar_panels, dress, head

FIRST, TOTAL = MAIN, "#9cc7e8"
BAR, ROW_IN, HEAD_IN = 0.36, 0.27, 0.62


def draw_indices(metrics: Mapping[str, Mapping[str, Any]], *, title: str, subtitle: str = "") -> Figure:
    """Returns two bars for each input of each metric, which are those of `indices.json` that have indices."""
    inputs = max((len(one["indices"]) for one in metrics.values()), default=1)
    figure, places = bar_panels(
        title,
        subtitle,
        len(metrics),
        bars=inputs,
        row_in=ROW_IN,
        head_in=HEAD_IN,
        bottom_in=0.4,
        left=0.13,
        wspace=0.32,
    )
    for axes, (name, metric) in zip(places, metrics.items(), strict=True):
        _draw(axes, name, metric)
    if metrics:
        handles, labels = places[0].get_legend_handles_labels()
        right = 1.0 - 0.12 / 9.6
        figure.legend(
            handles, labels, loc="upper right", bbox_to_anchor=(right, 1.0), ncols=3, fontsize=8, frameon=False
        )
    return figure


def _draw(axes: Axes, name: str, metric: Mapping[str, Any]) -> None:
    indices = metric["indices"]
    dress(axes)
    head(axes, name)
    unresolved = metric["unresolved"]
    if unresolved is not None and unresolved > 0.005:
        axes.axvspan(0.0, unresolved, color="#eceef2", linewidth=0, zorder=0)
        head(axes, f"unresolved {unresolved:.0%}", side="right", fontsize=8, color=QUIET)
    for kind, colour, shift in (("first", FIRST, -0.5), ("total", TOTAL, 0.5)):
        places = [place + shift * BAR for place in range(len(indices))]
        # Of what is known by an interval alone the line has no bar.
        values = [max(one[kind]["value"] or 0.0, 0.0) for one in indices.values()]
        label = {"first": "first order: alone", "total": "total: with others too"}[kind]
        axes.barh(places, values, BAR, color=colour, linewidth=0, label=label)
        for place, one in zip(places, indices.values(), strict=True):
            axes.plot([one[kind]["low"], one[kind]["high"]], [place, place], color=INK, linewidth=1.0)
    axes.axvline(0.0, color=FAINT, linewidth=0.8)
    axes.set_yticks(range(len(indices)), list(indices))
    axes.set_ylim(len(indices) - 0.4, -0.6)
    axes.set_xlim(-0.06, 1.06)
