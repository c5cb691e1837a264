"""Attitudes of single samples: an angle of each that explains it, what is left, and the shares of light."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from jaxsat.plotting.style import (
    FAINT,
    INK,
    LEFT_OUT,
    MAIN,
    dress,
    head,
    new_figure,
    nice_ceiling,
    shade_shadow,
    time_limits,
)

STATUS_COLOURS = {
    "solved": MAIN,
    "ambiguous": "#d99e10",
    "undetermined": "#c26fa6",
    "does not fit": LEFT_OUT,
    "unsolved": FAINT,
}
STATUS_MARKS = {"solved": "o", "ambiguous": "s", "undetermined": "^", "does not fit": "X", "unsolved": "v"}
_SHARE_COLOURS = ("#d99e10", "#3b9fe8")


def draw_local_attitudes(
    t_s: np.ndarray,
    angle_deg: np.ndarray,
    sigma_deg: np.ndarray,
    rms_mA: np.ndarray,
    shares: Mapping[str, np.ndarray],
    *,
    status: np.ndarray,
    lit: np.ndarray,
    angle_name: str = "angle of body x to the field, deg",
    angle_range_deg: tuple[float, float] = (0.0, 180.0),
    title: str = "Attitude of each sample by itself",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of attitudes [time found] by one angle, the best first, NaN for none; the rest are [time].

    Colours and shapes tell the status of a sample; its other attitudes are small and hollow.
    """
    figure = new_figure(11.0, 8.0, title, subtitle)
    frame = {"left": 0.065, "right": 0.985, "top": 0.875, "bottom": 0.06, "hspace": 0.22}
    upper, error, left, light = figure.subplots(
        4, 1, sharex=True, gridspec_kw={"height_ratios": [2.0, 1, 1, 1], **frame}
    )
    for axes in (upper, error, left, light):
        shade_shadow(axes, t_s, lit, label=axes is error)
    others = {"linestyle": "none", "marker": "o", "markersize": 3.4, "markerfacecolor": "white"}
    if angle_deg.shape[1] > 1 and np.isfinite(angle_deg[:, 1:]).any():
        handle = upper.plot(t_s, angle_deg[:, 1:], color=FAINT, markeredgewidth=0.8, **others)[0]
        handle.set_label("other attitude")
    for name, colour in STATUS_COLOURS.items():
        chosen = (status == name) & np.isfinite(rms_mA)
        if chosen.any():
            style = {"linestyle": "none", "marker": STATUS_MARKS[name], "markersize": 5, "color": colour}
            upper.plot(t_s[chosen], angle_deg[chosen, 0], label=name, **style)
            error.plot(t_s[chosen], sigma_deg[chosen], **{**style, "markersize": 4})
            left.plot(t_s[chosen], rms_mA[chosen], **{**style, "markersize": 4})
    low, high = angle_range_deg
    upper.set_ylim(low - 0.02 * (high - low), high + 0.02 * (high - low))
    upper.set_yticks(np.linspace(low, high, 5))
    if upper.get_legend_handles_labels()[0]:
        upper.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=5, fontsize=8.5, frameon=False)
    for colour, marker, (name, values) in zip(_SHARE_COLOURS, "os", shares.items(), strict=False):
        light.plot(t_s, values, linestyle="none", marker=marker, markersize=4, color=colour, label=name)
    light.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, fontsize=8.5, frameon=False)
    heads = (
        angle_name,
        "1σ about the least seen axis, deg",
        "residual RMS, mA",
        "factors of direct and returned sunlight",
    )
    for axes, text in zip((upper, error, left, light), heads, strict=True):
        dress(axes)
        head(axes, text)
    for axes, values in ((error, sigma_deg), (left, rms_mA), (light, np.concatenate(list(shares.values())))):
        finite = values[np.isfinite(values)]
        # Robust tops: one sample that is not seen at all must not flatten the others.
        top = float(np.quantile(finite, 0.97)) if finite.size else 1.0
        axes.set_ylim(-0.04 * nice_ceiling(1.1 * top), nice_ceiling(1.1 * top))
    light.set_xlabel("time since epoch, s", fontsize=9, color=INK)
    light.set_xlim(*time_limits(t_s))
    return figure
