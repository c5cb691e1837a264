"""Angle between body x and the magnetic field against time, with its 1-sigma band."""

import numpy as np
from matplotlib.figure import Figure

from jaxsat.plotting.style import AXIS_COLOURS, AXIS_STYLES, FAINT, INK, dress, new_figure, nice_ceiling, shade_shadow, time_limits


def draw_field_angle(
    t_s: np.ndarray,
    angle_deg: np.ndarray,
    sigma_deg: np.ndarray,
    *,
    attitude_sigma_deg: np.ndarray,
    lit: np.ndarray,
    title: str = "Angle between body x and the magnetic field",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of the field angle [time] with its 1-sigma band; below, the attitude's 1-sigma [time 3].

    The attitude's are about body x, y, z. A sample without a finite sigma has a line but no band.
    """
    figure = new_figure(11.0, 6.0, title, subtitle)
    upper, lower = figure.subplots(
        2,
        1,
        sharex=True,
        gridspec_kw={
            "height_ratios": [2.6, 1.0],
            "left": 0.06,
            "right": 0.985,
            "top": 0.89,
            "bottom": 0.08,
            "hspace": 0.08,
        },
    )
    known = np.isfinite(sigma_deg)
    band = np.where(known, sigma_deg, 0.0)
    upper.fill_between(
        t_s,
        np.maximum(angle_deg - band, 0.0),
        angle_deg + band,
        where=known.tolist(),
        color="#3b9fe8",
        alpha=0.35,
        linewidth=0,
        label="±1σ",
    )
    upper.plot(t_s, angle_deg, color="#14497a", linewidth=1.4, label="angle")
    upper.set_ylim(0.0, nice_ceiling(1.05 * float(np.nanmax(angle_deg + band))))
    shade_shadow(upper, t_s, lit, label=True)
    dress(upper, y_label="angle, deg")
    upper.legend(loc="upper right", ncols=2, fontsize=8.5, frameon=False)

    shade_shadow(lower, t_s, lit)
    for axis, sigma in zip("xyz", attitude_sigma_deg.T, strict=True):
        lower.plot(t_s, sigma, color=AXIS_COLOURS[axis], linestyle=AXIS_STYLES[axis], linewidth=1.1, label=f"about {axis}")
    lower.plot(
        t_s, np.where(known, sigma_deg, np.nan), color=INK, linewidth=1.1, linestyle=(0, (7, 2, 1.5, 2)), label="field angle"
    )
    finite = np.concatenate([attitude_sigma_deg[np.isfinite(attitude_sigma_deg)], sigma_deg[known]])
    if finite.size:
        lower.set_ylim(0.0, nice_ceiling(1.25 * float(finite.max())))
        lower.legend(loc="upper right", ncols=4, fontsize=8, frameon=False, borderaxespad=0.1)
    else:
        lower.text(0.5, 0.5, "1σ unknown", transform=lower.transAxes, ha="center", va="center", color=FAINT, fontsize=9)
    dress(lower, y_label="attitude 1σ, deg", x_label="time since epoch, s")
    lower.set_xlim(*time_limits(t_s))
    return figure
