"""Profile likelihood of one parameter: the cost's rise over its values, beside the parabola of its sigma."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

from jaxsat.plotting.style import AXIS_COLOURS, FAINT, INK, LEFT_OUT, MAIN, dress, new_figure

PROFILE, BAND_68, BAND_95 = MAIN, "#b9dcf2", "#e3f1fa"
LEVELS = {"68 %": 0.5, "95 %": 1.92}
"""Rises of the cost, half of chi2, that bound the intervals."""


def draw_profile(
    values: np.ndarray,
    rise: np.ndarray,
    *,
    best: float,
    sigma: float | None,
    interval_68: Sequence[float | None],
    interval_95: Sequence[float | None],
    name: str,
    unit: str,
    rise_data: np.ndarray | None = None,
    settled: np.ndarray | None = None,
    subtitle: str = "",
) -> Figure:
    """Returns the picture of a profile [values], in the unit of the name; an end of an interval may be open (None).

    `rise_data` is the part of the data, without the priors; a value that is not `settled` is crossed out.
    """
    figure = new_figure(8.6, 5.2, f"Profile of {name}", subtitle)
    axes = figure.subplots(gridspec_kw={"left": 0.08, "right": 0.975, "top": 0.86, "bottom": 0.11})
    low, high = float(values.min()), float(values.max())
    margin = 0.04 * (high - low) or 1.0
    ceiling = 1.25 * max(float(rise.max()), LEVELS["95 %"])
    for (begin, end), colour, label in ((interval_95, BAND_95, "95 %"), (interval_68, BAND_68, "68 %")):
        left, right = (low - margin if begin is None else begin), (high + margin if end is None else end)
        axes.axvspan(left, right, color=colour, linewidth=0, zorder=0, label=f"{label} interval")
    for label, level in LEVELS.items():
        axes.axhline(level, color=FAINT, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.annotate(
            label, (1.0, level), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize=8, color=INK
        )
    if sigma is not None:
        x = np.linspace(low - margin, high + margin, 200)
        axes.plot(x, 0.5 * ((x - best) / sigma) ** 2, color=FAINT, linewidth=1.2, label="parabola of 1σ")
    # The curve that the intervals are read from.
    fine = np.linspace(low, high, 300)
    if rise_data is not None:
        curve = CubicSpline(values, rise_data)(fine)
        axes.plot(fine, curve, color=AXIS_COLOURS["y"], linewidth=1.2, linestyle=":", label="without priors", zorder=4)
    axes.plot(fine, CubicSpline(values, rise)(fine), color=PROFILE, linewidth=1.4, label="profile")
    axes.plot(values, rise, "o", color=PROFILE, markersize=4)
    if settled is not None and not np.all(settled):
        axes.plot(values[~settled], rise[~settled], "x", color=LEFT_OUT, markersize=9, label="solver stopped early")
    axes.set_xlim(low - margin, high + margin)
    axes.set_ylim(min(-0.03 * ceiling, 1.1 * float(rise.min())), ceiling)
    dress(axes, x_label=f"{name}, {unit}" if unit else name, y_label="rise of the cost (half of χ²)")
    axes.legend(loc="upper center", ncols=3, fontsize=8.5, framealpha=0.85, edgecolor="none")
    return figure
