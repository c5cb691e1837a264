"""The picture of the study of designs: chosen times, and sigmas beside what refits found."""

from typing import Any

import numpy as np

from jaxsat.plotting.style import FAINT, INK, MAIN, dress, head, new_figure, png_bytes

PREDICTED, FOUND = MAIN, "#c0392b"


def picture(found: dict[str, Any]) -> bytes:
    """PNG content."""
    times, cells = found["times"], found["cells"]
    subtitle = f"{times['sent']} of {times['candidates']} samples, and three cells; {found['refits']} refits of each"
    figure = new_figure(8.6, 5.4, "Designs and what refits found of them", subtitle)
    above = figure.add_axes((0.15, 0.57, 0.82, 0.27))
    below = [figure.add_axes((left, 0.13, 0.2, 0.28)) for left in (0.15, 0.42, 0.76)]
    names = [design["name"] for design in times["designs"]]
    for row, design in enumerate(times["designs"]):
        above.plot(
            design["t_s"], np.full(len(design["t_s"]), row), "o", markersize=5, color=PREDICTED if row else FAINT
        )
    for row, (_, bound) in enumerate(times["bounds"].items(), start=1):
        at = times["every_s"] * np.arange(times["candidates"])
        above.bar(at, -0.5 * np.asarray(bound["weights"]), width=6.0, bottom=row - 0.12, color="#c9d3e2", zorder=0)
    above.set_yticks(range(len(names)), names)
    above.set_ylim(len(names) - 0.4, -0.6)
    dress(above, x_label="time of the sample, s")
    head(above, "Chosen samples; bars: best weights as real numbers")
    bounds = times["bounds"]
    _bars(below[0], times["designs"], "attitude", "12 samples: attitude, deg", bounds["attitude"]["bound"])
    _bars(below[1], times["designs"], "magnet.x", "dipole x, 1e-5 A m²", bounds["magnet.x"]["bound"], 1e5)
    below[1].set_yticklabels([])
    _bars(below[2], cells["designs"], "attitude", "Three cells: attitude, deg", None)
    handles, labels = below[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, fontsize=8, frameon=False)
    return png_bytes(figure)


def _bars(
    axes: Any, designs: list[dict[str, Any]], aim: str, title: str, bound: float | None, factor: float = 1.0
) -> None:
    place = np.arange(len(designs))
    rows = [design["found"][aim] for design in designs]
    axes.barh(place - 0.17, [factor * row["predicted"] for row in rows], 0.3, color=PREDICTED, label="predicted")
    axes.barh(place + 0.17, [factor * row["scatter"] for row in rows], 0.3, color=FOUND, label="refits")
    if bound is not None:
        axes.axvline(factor * bound, color=INK, linewidth=0.9, linestyle=(0, (4, 3)), label="no 12 samples are below")
    axes.set_yticks(place, [design["name"] for design in designs])
    axes.invert_yaxis()
    axes.locator_params(axis="x", nbins=4)
    dress(axes)
    head(axes, title)
