"""The picture of slopes in three ways."""

from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.plotting.style import dress, head, new_figure, png_bytes

COLOURS = {"exact": "#c0392b", "normal": "#2e8b3d"}
EDGE = 12.0
"""Errors beyond which a mark stands at the edge."""


def picture(loops: dict[str, Any], path: Path) -> None:
    """A panel for each set of loops: slopes in errors of the smoothed one, by metric and knob."""
    figure = new_figure(
        11.5,
        5.2,
        "Slopes of means in three ways",
        "less the slope with the knob moved by 5 % to both sides, in its 1-sigma; lines are 1-sigma",
    )
    panels = figure.subplots(
        1, len(loops), gridspec_kw={"left": 0.19, "right": 0.98, "top": 0.82, "bottom": 0.13, "wspace": 1.25}
    )
    for axes, (title, found) in zip(panels, loops.items(), strict=True):
        dress(axes, x_label="off by, 1-sigma")
        head(axes, title, fontsize=8.5)
        rows = [(f"{name}, {knob}", one) for name, own in found["metrics"].items() for knob, one in own.items()]
        rows = [(label, one) for label, one in rows if one["smoothed"][1] > 0.0]
        axes.axvspan(-3.0, 3.0, color="#eceef2", linewidth=0, zorder=0)
        for place, (_, one) in enumerate(rows):
            middle, size = one["smoothed"]
            for way, shift in (("exact", -0.2), ("normal", 0.2)):
                value, error = ((x - y) / size for x, y in zip(one[way], (middle, 0.0), strict=True))
                at = float(np.clip(value, -EDGE, EDGE))
                axes.plot([at - error, at + error], [place + shift] * 2, color=COLOURS[way], linewidth=1.0)
                axes.plot(at, place + shift, "o" if abs(value) < EDGE else "d", color=COLOURS[way], markersize=3.5)
        axes.set_yticks(range(len(rows)), [label for label, _ in rows], fontsize=5.5)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlim(-13.0, 13.0)
    for way, x in (("exact", 0.60), ("normal", 0.75)):
        label = {"exact": "exact derivatives", "normal": "with normal moves"}[way]
        figure.text(x, 0.965, f"● {label}", fontsize=7.5, color=COLOURS[way])
    path.write_bytes(png_bytes(figure))
