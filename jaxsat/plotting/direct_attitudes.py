"""Attitudes of single samples by directions: rates by finite turns, how directions agree, and 1-sigma."""

import numpy as np
from matplotlib.figure import Figure

from jaxsat.plotting.local_attitudes import STATUS_COLOURS, STATUS_MARKS
from jaxsat.plotting.style import (
    AXIS_COLOURS,
    FAINT,
    INK,
    LEFT_OUT,
    dress,
    head,
    new_figure,
    nice_ceiling,
    time_limits,
)

COLOURS = {**STATUS_COLOURS, "inconsistent": LEFT_OUT}
MARKS = {**STATUS_MARKS, "inconsistent": "X"}
AXIS_MARKS = "osd"


def draw_direct_attitudes(
    t_s: np.ndarray,
    rate_deg_s: np.ndarray,
    mismatch_deg: np.ndarray,
    mismatch_sigma_deg: np.ndarray,
    sigma_deg: np.ndarray,
    *,
    status: np.ndarray,
    title: str = "Attitude of each sample by itself",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of rates [time 3], of the mismatch of directions and of the attitude's 1-sigma [time].

    Colours and shapes tell the status of a sample; the band is what the mismatch may be, 1-sigma.
    """
    figure = new_figure(9.6, 6.6, title, subtitle)
    frame = {"left": 0.075, "right": 0.985, "top": 0.86, "bottom": 0.075, "hspace": 0.3}
    upper, middle, lower = figure.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [1.4, 1, 1], **frame})
    for (axis, colour), marker, column in zip(AXIS_COLOURS.items(), AXIS_MARKS, rate_deg_s.T, strict=True):
        # Samples may lie further apart than the motion's own period, and a line would then be a tale.
        upper.plot(t_s, column, marker, color=colour, markersize=2.2, label=axis)
    band = np.nan_to_num(mismatch_sigma_deg)
    middle.fill_between(t_s, -band, band, color=FAINT, alpha=0.25, linewidth=0.0, step="mid")
    for name, colour in COLOURS.items():
        chosen = status == name
        style = {"linestyle": "none", "marker": MARKS[name], "markersize": 3.2, "color": colour}
        if (chosen & np.isfinite(mismatch_deg)).any():
            middle.plot(t_s[chosen], mismatch_deg[chosen], label=name, **style)
        if (chosen & np.isfinite(sigma_deg)).any():
            lower.plot(t_s[chosen], sigma_deg[chosen], **style)
    heads = (
        "angular velocity about body x, y, z by finite turns, deg/s",
        "angle between two directions in the body less that outside, deg",
        "1σ about the least seen axis, deg",
    )
    for axes, text in zip((upper, middle, lower), heads, strict=True):
        dress(axes)
        head(axes, text)
    for axes in (upper, middle):
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=5, fontsize=8.5, frameon=False)
    finite = sigma_deg[np.isfinite(sigma_deg)]
    top = float(np.quantile(finite, 0.97)) if finite.size else 0.0
    lower.set_ylim(0.0, nice_ceiling(1.15 * top if top > 0.0 else 1.0))
    lower.set_xlabel("time since epoch, s", fontsize=9, color=INK)
    lower.set_xlim(*time_limits(t_s))
    return figure
