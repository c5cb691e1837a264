"""Picture of the fit of the station's magnetometer: readings, residuals, and what a new turn and bias leave of them."""

from pathlib import Path

import numpy as np

from experiments.flight.small_png import small_png
from jaxsat.plotting.style import AXIS_COLOURS, INK, LEFT_OUT, SHADOW, dress, head, new_figure

HOUR = 3600.0
SPAN = (0.0, 14.0)
"""Hours shown."""


def draw_iss(path: Path, whole, until, after) -> None:
    """Writes the PNG of three results: of the whole, up to the break, and behind it (or None)."""
    figure = new_figure(9.0, 6.6, "A magnetometer in the Space Station", "fitted 0.75-5.5 h, the rest predicted")
    rows = figure.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [1.3, 1.0, 1.0]})
    figure.subplots_adjust(left=0.08, right=0.98, top=0.88, bottom=0.08, hspace=0.28)
    channel = whole.channels["mag"]
    t = channel.t_s / HOUR
    shown = (t >= SPAN[0]) & (t <= SPAN[1])
    colours = dict(zip(range(3), AXIS_COLOURS.values(), strict=True))
    for k, colour in colours.items():
        rows[0].plot(t[shown], channel.measured[shown, k], ".", ms=1.2, color=colour)
        rows[0].plot(t[shown], channel.modelled[shown, k], lw=0.7, color=colour, label=f"Mag{'XYZ'[k]}")
    rows[0].legend(fontsize=8, ncols=3, loc="upper right", frameon=False)
    head(rows[0], "measured (dots) and modelled (lines)")
    _residuals(rows[1], [whole], colours, 12.0)
    head(rows[1], "measured less modelled")
    _residuals(rows[2], [until] if after is None else [until, after], colours, 3.0)
    head(rows[2], "the same, with turn and bias fitted anew behind the break")
    for row in rows:
        dress(row, y_label="uT")
        row.axvspan(0.75, 5.5, color=SHADOW, lw=0, zorder=0)
        for each in channel.breaks:
            row.axvline(each.t_s / HOUR, color=LEFT_OUT, lw=1.0)
    for each in channel.breaks:
        text = f" {each.t_s / HOUR:.2f} h: turned by {each.turn_deg:.1f} deg"
        rows[1].text(each.t_s / HOUR, 10.0, text, fontsize=8.5, color=LEFT_OUT, va="top")
    rows[1].text(0.8, 10.0, "fitted", fontsize=8.5, color=INK, va="top")
    rows[2].set_xlim(*SPAN)
    rows[2].set_xlabel("hours after 2022-01-31 12:21:15 UTC", fontsize=9)
    path.write_bytes(small_png(figure))


def _residuals(row, results, colours, limit) -> None:
    for result in results:
        channel = result.channels["mag"]
        residual, t = channel.residual * channel.sigma, channel.t_s / HOUR
        shown = (t >= SPAN[0]) & (t <= SPAN[1]) & np.isfinite(residual).all(axis=1)
        for k, colour in colours.items():
            row.plot(t[shown], residual[shown, k], ".", ms=1.0, color=colour)
    row.set_ylim(-limit, limit)
