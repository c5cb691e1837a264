"""Angular velocity and the attitude's 1-sigma against time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxsat.plotting.channels.timeline import Timeline
from jaxsat.plotting.style import AXIS_COLOURS, AXIS_STYLES, FAINT, INK, dress, head, new_figure, nice_ceiling

HEIGHT_IN = 5.6
DOTS = 150
"""Samples up to which each has a dot."""


def draw_motion(
    t_s: np.ndarray,
    rate_deg_s: np.ndarray,
    attitude_sigma_deg: np.ndarray,
    timeline: Timeline,
    *,
    curve: tuple[np.ndarray, np.ndarray] | None = None,
    title: str = "Angular velocity and attitude",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of rates [time 3] about the body axes; below, the attitude's 1-sigma [time 3] about them.

    `curve` are times and rates [time 3] of the motion between the samples, which the lines then go through.
    """
    figure = new_figure(9.6, HEIGHT_IN, title, subtitle)
    frame = {"left": 0.075, "right": 0.985, "top": 0.81, "bottom": 0.09, "hspace": 0.26}
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.6, 1.0], **frame})
    _curves(upper, *(curve or (t_s, rate_deg_s)), "")
    for colour, column in zip(AXIS_COLOURS.values(), rate_deg_s.T, strict=True):
        # More dots would hide the dashes.
        if len(t_s) <= DOTS:
            upper.plot(t_s, column, ".", color=colour, markersize=2.6)
    _curves(lower, t_s, attitude_sigma_deg, "about ")
    head(upper, "angular velocity about body x, y, z, deg/s")
    head(lower, "1σ of a small turn, deg")
    finite = attitude_sigma_deg[np.isfinite(attitude_sigma_deg)]
    if finite.size and finite.max() > 0.0:
        lower.set_ylim(0.0, nice_ceiling(1.15 * float(finite.max())))
    else:
        lower.text(0.5, 0.5, "1σ unknown", transform=lower.transAxes, ha="center", va="center", color=FAINT, fontsize=9)
    for axes in (upper, lower):
        dress(axes)
        timeline.dress(axes)
    lower.set_xlabel("time since epoch, s", fontsize=9, color=INK)
    handles = [*upper.get_lines()[:3], *timeline.legend()]
    figure.legend(
        handles=handles,
        loc="upper left",
        ncols=6,
        fontsize=8.5,
        frameon=False,
        bbox_to_anchor=(0.002, 1.0 - 0.52 / HEIGHT_IN),
    )
    return figure


def _curves(axes: Axes, t_s: np.ndarray, values: np.ndarray, prefix: str) -> None:
    for (axis, colour), column in zip(AXIS_COLOURS.items(), values.T, strict=True):
        axes.plot(t_s, column, color=colour, linestyle=AXIS_STYLES[axis], linewidth=1.2, label=f"{prefix}{axis}")
