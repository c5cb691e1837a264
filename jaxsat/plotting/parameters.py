"""The fitted parameters with their 1-sigma as a picture of a table."""

import textwrap
from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jaxsat.plotting.style import FAINT, INK, QUIET, new_figure

ROW_IN = 0.235
FOOTER_CHARACTERS = 110
"""Length at which a line of the footer is broken: the picture's width."""
COLUMNS_IN = {"parameter": 0.15, "value": 3.05, "1σ": 3.30, "unit": 4.35, "note": 5.35}
"""Where each column begins [in]; `value` is where it ends, because numbers stand at the right."""


def draw_parameters(
    rows: Sequence[tuple[str, str, str, str, str]],
    *,
    title: str = "Parameters",
    subtitle: str = "",
    footer: Sequence[str] = (),
) -> Figure:
    """Returns the picture of a table; a row is (name, value, sigma, unit, note), all as text, sigma empty where fixed.

    `footer` holds lines below the table, such as the gauge.
    """
    # A satellite with many blind combinations has a long one.
    footer = [part for line in footer for part in textwrap.wrap(line, FOOTER_CHARACTERS)]
    width = 8.6
    height = 0.62 + ROW_IN * (len(rows) + 1.6 + 0.9 * len(footer))
    figure = new_figure(width, height, title, subtitle)

    def put(column: str, y: float, text: str, **style) -> None:
        align = "right" if column == "value" else "left"
        figure.text(
            COLUMNS_IN[column] / width,
            y / height,
            text,
            ha=align,
            va="center",
            **{"fontsize": 9, "color": INK, **style},
        )

    y = height - 0.62 - 0.5 * ROW_IN
    for column in COLUMNS_IN:
        put(column, y, column, fontsize=8.5, color=QUIET, fontweight="bold")
    _rule(figure, (y - 0.5 * ROW_IN) / height, width)
    for name, value, sigma, unit, note in rows:
        y -= ROW_IN
        colour = INK if sigma else FAINT
        put("parameter", y, name, color=colour)
        put("value", y, value, color=colour, family="monospace")
        put("1σ", y, f"± {sigma}" if sigma else "", family="monospace")
        put("unit", y, unit, color=colour)
        put("note", y, note, color=QUIET, fontsize=8.5)
    _rule(figure, (y - 0.55 * ROW_IN) / height, width)
    for line in footer:
        y -= 0.9 * ROW_IN
        put("parameter", y - 0.2 * ROW_IN, line, fontsize=8.5, color=QUIET)
    return figure


def _rule(figure: Figure, y: float, width: float) -> None:
    margin = 0.12 / width
    figure.add_artist(Line2D([margin, 1.0 - margin], [y, y], color=FAINT, linewidth=0.7))
