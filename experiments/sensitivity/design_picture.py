"""The picture of the study of designs: chosen times, and sigmas beside what refits found."""

from typing import Any

import numpy as np

from jaxsat.plotting.style import FAINT, INK, dress, head, new_figure, png_bytes

PREDICTED, FOUND = "#14497a", "#c0392b"


def picture(found: dict[str, Any]) -> bytes:
    """PNG content."""
    times, cells = found["times"], found["cells"]
    subtitle = f"{times['sent']} of {times['candidates']} samples, and three cells; {found['refits']} refits of each"
    figure = new_figure(8.6, 5.2, "Designs and what refits found of them", subtitle)
    above, left, right = (
        figure.add_axes(place) for place in ((0.17, 0.56, 0.8, 0.27), (0.17, 0.1, 0.33, 0.3), (0.64, 0.1, 0.33, 0.3))
    )
    names = [design["name"] for design in times["designs"]]
    for row, design in enumerate(times["designs"]):
        above.plot(
            design["t_s"], np.full(len(design["t_s"]), row), "o", markersize=5, color=PREDICTED if row else FAINT
        )
    for row, (_, bound) in enumerate(times["bounds"].items(), start=1):
        at = times["every_s"] * np.arange(times["candidates"])
        above.bar(at, 0.45 * np.asarray(bound["weights"]), width=6.0, bottom=row - 0.5, color="#c9d3e2", zorder=0)
    above.set_yticks(range(len(names)), names)
    above.set_ylim(len(names) - 0.4, -0.6)
    dress(above, x_label="time of the sample, s")
    head(above, "Chosen samples; bars: best weights as real numbers")
    _bars(left, times["designs"], "12 samples: attitude, deg RMS", times["bounds"]["attitude"]["bound"])
    _bars(right, cells["designs"], "Three cells: attitude, deg RMS", None)
    return png_bytes(figure)


def _bars(axes: Any, designs: list[dict[str, Any]], title: str, bound: float | None) -> None:
    place = np.arange(len(designs))
    rows = [design["found"]["attitude"] for design in designs]
    axes.barh(place - 0.17, [row["predicted"] for row in rows], 0.3, color=PREDICTED, label="predicted")
    axes.barh(place + 0.17, [row["scatter"] for row in rows], 0.3, color=FOUND, label="refits")
    if bound is not None:
        axes.axvline(bound, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    axes.set_yticks(place, [design["name"] for design in designs])
    axes.invert_yaxis()
    axes.legend(fontsize=7.5, framealpha=0.85, edgecolor="none")
    dress(axes)
    head(axes, title)
