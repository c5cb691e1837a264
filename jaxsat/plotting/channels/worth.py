"""What the free parts of a model buy, as bars."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from jaxsat.plotting.style import FAINT, INK, MAIN, dress, new_figure

ROW_IN = 0.28
LEAST = 1.0
"""Rise of chi2 at the left edge: less is worth nothing."""


def draw_worth(buys: Mapping[str, float], *, title: str = "What each part buys", subtitle: str = "") -> Figure:
    """Returns the picture of rises of chi2 by part, on a logarithmic axis; a part that buys nothing has no bar."""
    height = 1.25 + ROW_IN * max(len(buys), 1)
    figure = new_figure(8.6, height, title, subtitle)
    axes = figure.add_axes((0.26, 0.52 / height, 0.62, ROW_IN * max(len(buys), 1) / height))
    rises = np.array([max(float(rise), LEAST) for rise in buys.values()])
    rows = np.arange(len(rises))
    axes.barh(rows, rises - LEAST, left=LEAST, height=0.6, color=MAIN)
    axes.set_xscale("log")
    # Plain numbers: powers as mathematics would load six more fonts.
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(LEAST, 4.0 * float(rises.max(initial=10.0)))
    for row, (rise, shown) in enumerate(zip(buys.values(), rises, strict=True)):
        text = f"{rise:.0f}" if rise >= 10.0 else f"{rise:z.1f}"
        axes.text(1.12 * shown, row, text, va="center", fontsize=8.5, color=INK)
    axes.set_yticks(rows, list(buys))
    axes.set_ylim(len(rises) - 0.4, -0.6)
    dress(axes, x_label="rise of χ² where it is put back to its nominal values and the rest is fitted anew")
    axes.tick_params(axis="y", length=0, labelsize=9)
    axes.axvline(LEAST, color=FAINT, linewidth=0.8)
    return figure
