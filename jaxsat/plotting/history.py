"""Quantities against time, one chart each: the history of a case of a sweep."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from jaxsat.plotting.style import (
    AXIS_COLOURS,
    AXIS_STYLES,
    INK,
    LINE_STYLES,
    LINES,
    dress,
    head,
    new_figure,
    time_limits,
)
from jaxsat.significant import unit_text

CHART_IN = 1.9


def draw_history(
    t_s: np.ndarray, charts: Mapping[str, Mapping[str, np.ndarray]], *, title: str, subtitle: str = ""
) -> Figure:
    """Returns the picture of quantities [time]; `charts` maps the heading of a chart, with its unit, to named curves.

    Curves called x, y, z have the colours and dashes of the body axes; a single one needs no name.
    """
    height = 0.75 + CHART_IN * len(charts)
    figure = new_figure(9.6, height, title, subtitle)
    grid = figure.subplots(
        len(charts),
        1,
        sharex=True,
        squeeze=False,
        gridspec_kw={
            "left": 0.06,
            "right": 0.985,
            "top": 1.0 - 0.85 / height,
            "bottom": 0.45 / height,
            "hspace": 0.24,
        },
    )
    for axes, (label, curves) in zip(grid.flat, charts.items(), strict=True):
        for number, (name, values) in enumerate(curves.items()):
            colour = AXIS_COLOURS.get(name, LINES[number % len(LINES)])
            dashes = AXIS_STYLES.get(name, LINE_STYLES[number % len(LINE_STYLES)])
            axes.plot(t_s, values, color=colour, linestyle=dashes, linewidth=1.2, label=name or None)
        if any(curves):
            # Above the axes, where no curve passes.
            axes.legend(
                loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=len(curves), fontsize=8, frameon=False, borderpad=0
            )
        dress(axes)
        if all(_counted(values) for values in curves.values()):
            axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        head(axes, unit_text(label))
    last = grid.flat[len(charts) - 1]
    last.set_xlabel("time, s", fontsize=9, color=INK)
    last.set_xlim(*time_limits(t_s))
    return figure


def _counted(values: np.ndarray) -> bool:
    """Whether there are none but whole numbers, as those of modes."""
    known = values[np.isfinite(values)]
    return bool(np.all(known == np.round(known)))
