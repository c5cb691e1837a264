"""How each metric of a sweep is distributed over its cases."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from jaxsat.plotting.style import FAILED, FAINT, INK, QUIET, SUCCEEDED, dress, head, new_figure, panels, rows_of
from jaxsat.significant import count_text, unit_text, value_text
from jaxsat.sweep.summary import MetricSummary

ROW_IN = 2.9
MEANING_CHARACTERS = 74
"""Length at which what a metric means is broken."""


def draw_distributions(metrics: Sequence[MetricSummary], *, title: str = "Distributions", subtitle: str = "") -> Figure:
    """Returns a histogram of each metric, cases that failed on top of those that succeeded, with 5, 50 and 95 %."""
    columns = min(2, max(1, len(metrics)))
    rows = rows_of(len(metrics), columns)
    height = 0.95 + ROW_IN * rows
    figure = new_figure(9.6, height, title, subtitle)
    places = panels(
        figure,
        len(metrics),
        columns=columns,
        left=0.07,
        right=0.985,
        top=1.0 - 0.85 / height,
        bottom=0.84 / height,
        hspace=0.62,
        wspace=0.16,
    )
    for axes, metric in zip(places, metrics, strict=True):
        _draw(axes, metric)
    if any(metric.failed.any() for metric in metrics):
        shown = next(axes for axes, metric in zip(places, metrics, strict=False) if metric.edges.size)
        shown.legend(loc="upper right", fontsize=8, frameon=False)
    return figure


def _draw(axes: Axes, metric: MetricSummary) -> None:
    dress(axes, y_label="cases", x_label=", ".join(filter(None, [metric.title, unit_text(metric.unit)])))
    axes.xaxis.label.set_fontweight("bold")
    meaning = textwrap.fill(metric.meaning, MEANING_CHARACTERS)
    axes.annotate(
        meaning,
        (0.5, 0.0),
        (0, -31),
        "axes fraction",
        "offset points",
        ha="center",
        va="top",
        fontsize=7.5,
        color=QUIET,
    )
    axes.yaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))
    notes = []
    if metric.missing:
        notes.append(f"{count_text(metric.missing, 'case')} without it")
    if metric.beyond:
        notes.append(f"{metric.beyond} beyond the axis")
    head(axes, ", ".join(notes), side="right", fontsize=8, color=QUIET)
    if metric.edges.size == 0:
        axes.text(0.5, 0.5, "no case has it", transform=axes.transAxes, ha="center", va="center", color=FAINT)
        axes.set_xticks([])
        axes.set_yticks([])
        return
    if metric.logarithmic:
        axes.set_xscale("log")
    left, widths = metric.edges[:-1], np.diff(metric.edges)
    axes.bar(left, metric.succeeded, widths, align="edge", color=SUCCEEDED, linewidth=0, label="succeeded")
    axes.bar(
        left,
        metric.failed,
        widths,
        align="edge",
        bottom=metric.succeeded,
        color=FAILED,
        linewidth=0,
        hatch="////",
        edgecolor="white",
        label="failed",
    )
    axes.set_xlim(metric.edges[0], metric.edges[-1])
    if metric.whole:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    marks = {name: value for name, value in metric.percentiles.items() if name != "max"}
    for name, value in marks.items():
        axes.axvline(value, color=INK, linewidth=0.9, linestyle="-" if name == "p50" else (0, (3, 2)))
    head(axes, "5, 50, 95 %: " + ", ".join(value_text(metric.shown(name), 4) for name in marks), fontsize=8)
