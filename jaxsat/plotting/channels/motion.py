"""Attitude, angular velocity and the attitude's 1-sigma against time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxsat.plotting.channels.timeline import Timeline
from jaxsat.plotting.style import AXIS_COLOURS, AXIS_STYLES, FAINT, INK, dress, head, new_figure, nice_ceiling

HEIGHT_IN = 7.4
DOTS = 150
"""Samples up to which each has a dot."""


def draw_motion(
    t_s: np.ndarray,
    quaternion: np.ndarray,
    rate_deg_s: np.ndarray,
    attitude_sigma_deg: np.ndarray,
    timeline: Timeline,
    *,
    curves: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None,
    title: str = "Attitude and angular velocity",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of attitudes [time 4], scalar first, and rates [time 3] about the body axes.

    Below them is the attitude's 1-sigma [time 3] about these axes. `curves` are times, attitudes and rates of the
    motion between the samples, through which lines then go.
    """
    figure = new_figure(9.6, HEIGHT_IN, title, subtitle)
    frame = {"left": 0.075, "right": 0.985, "top": 0.855, "bottom": 0.07, "hspace": 0.3}
    charts = figure.subplots(3, 1, sharex=True, gridspec_kw={"height_ratios": [1.4, 1.4, 1.0], **frame})
    upper, middle, lower = charts
    along, attitudes, rates = curves or (t_s, quaternion, rate_deg_s)
    signs = _signs(attitudes)
    upper.plot(along, attitudes[:, 0] * signs, color=INK, linestyle=(0, (5, 1.5, 1, 1.5)), linewidth=1.2, label="w")
    _curves(upper, along, attitudes[:, 1:] * signs[:, None])
    _curves(middle, along, rates)
    # More dots would hide the dashes.
    if len(t_s) <= DOTS:
        at_samples = quaternion * signs[np.searchsorted(along, t_s).clip(max=len(along) - 1)][:, None]
        for colour, column in zip((INK, *AXIS_COLOURS.values()), at_samples.T, strict=True):
            upper.plot(t_s, column, ".", color=colour, markersize=2.6)
        for colour, column in zip(AXIS_COLOURS.values(), rate_deg_s.T, strict=True):
            middle.plot(t_s, column, ".", color=colour, markersize=2.6)
    _curves(lower, t_s, attitude_sigma_deg)
    head(upper, "quaternion w, x, y, z, body to inertial axes")
    head(middle, "angular velocity about body x, y, z, deg/s")
    head(lower, "1σ of a small turn about body x, y, z, deg")
    upper.set_ylim(-1.08, 1.08)
    finite = attitude_sigma_deg[np.isfinite(attitude_sigma_deg)]
    if finite.size and finite.max() > 0.0:
        lower.set_ylim(0.0, nice_ceiling(1.15 * float(finite.max())))
    else:
        lower.text(0.5, 0.5, "1σ unknown", transform=lower.transAxes, ha="center", va="center", color=FAINT, fontsize=9)
    for axes in charts:
        dress(axes)
        timeline.dress(axes)
    lower.set_xlabel("time since epoch, s", fontsize=9, color=INK)
    handles = [*upper.get_lines()[:4], *timeline.legend()]
    figure.legend(
        handles=handles,
        loc="upper left",
        ncols=7,
        fontsize=8.5,
        frameon=False,
        bbox_to_anchor=(0.002, 1.0 - 0.52 / HEIGHT_IN),
    )
    return figure


def _signs(quaternion: np.ndarray) -> np.ndarray:
    """Of each attitude, so that none is drawn as a jump to the other side of the same turn."""
    turned = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0.0
    return np.where(np.concatenate(([0], np.cumsum(turned))) % 2, -1.0, 1.0)


def _curves(axes: Axes, t_s: np.ndarray, values: np.ndarray) -> None:
    for (axis, colour), column in zip(AXIS_COLOURS.items(), values.T, strict=True):
        axes.plot(t_s, column, color=colour, linestyle=AXIS_STYLES[axis], linewidth=1.2, label=axis)
