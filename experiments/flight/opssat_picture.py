"""Picture of two diodes along a given attitude: measured over modelled elevations, and the difference by day."""

from pathlib import Path

import numpy as np

from experiments.flight.small_png import small_png
from jaxsat.plotting.style import FAINT, INK, LEFT_OUT, dress, head, new_figure

DAY = 86400.0
COLOUR = "#2340a8"


def draw_opssat(path: Path, diodes, epoch) -> None:
    """Writes the PNG of `opssat.Diode`s."""
    figure = new_figure(9.0, 6.4, "Photodiodes of OPS-SAT", "elevation of the Sun over each diode's plane")
    rows = figure.subplots(2, len(diodes), gridspec_kw={"height_ratios": [1.7, 1.0]})
    figure.subplots_adjust(left=0.08, right=0.98, top=0.86, bottom=0.09, hspace=0.35, wspace=0.2)
    for column, each in zip(rows.T, diodes, strict=True):
        off, kept = each.clear & ~each.used, each.clear & each.used
        column[0].plot(each.modelled[kept], each.measured[kept], ".", ms=1.5, color=COLOUR)
        column[0].plot(each.modelled[off], each.measured[off], ".", ms=1.5, color=LEFT_OUT)
        column[0].plot([0, 90], [0, 90], color=INK, lw=0.8)
        column[0].set(xlim=(0, 90), ylim=(0, 92))
        text = f"{each.name}: median {np.median(each.off[each.clear]):.1f} deg off (red: left out)"
        head(column[0], text)
        dress(column[0], x_label="modelled, deg", y_label="measured, deg")
        days = each.t_s / DAY
        difference = each.measured - each.modelled
        column[1].axhline(0.0, color=FAINT, lw=0.8)
        column[1].plot(days[each.clear], difference[each.clear], ".", ms=1.2, color=COLOUR)
        column[1].set_ylim(-30, 30)
        dress(column[1], x_label=f"days after {epoch.iso(0)} UTC", y_label="difference, deg")
    path.write_bytes(small_png(figure))
