"""Angle between body x and the magnetic field against time, with its 1-sigma band."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from jaxsat.plotting.style import (
    AXIS_COLOURS,
    AXIS_STYLES,
    FAINT,
    INK,
    MAIN,
    SHADOW,
    dress,
    new_figure,
    nice_ceiling,
    shade_shadow,
    time_limits,
)


def draw_field_angle(
    t_s: np.ndarray,
    angle_deg: np.ndarray,
    sigma_deg: np.ndarray,
    *,
    attitude_sigma_deg: np.ndarray,
    lit: np.ndarray,
    curve: tuple[np.ndarray, np.ndarray] | None = None,
    title: str = "Angle between body x and the magnetic field",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of the field angle [time] with its 1-sigma band; below, the attitude's 1-sigma [time 3].

    The attitude's are about body x, y, z. A sample without a finite sigma has a line but no band. `curve` are times and
    angles between the samples too, which the line then goes through.
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
            "hspace": 0.2,
        },
    )
    known = np.isfinite(sigma_deg)
    band = np.where(known, sigma_deg, 0.0)
    times, angles = curve or (t_s, angle_deg)
    around = np.interp(times, t_s, band)
    upper.fill_between(
        times,
        np.maximum(angles - around, 0.0),
        angles + around,
        where=(np.interp(times, t_s, known.astype(float)) == 1.0).tolist(),
        color="#3b9fe8",
        alpha=0.35,
        linewidth=0,
        label="±1σ",
    )
    upper.plot(times, angles, color=MAIN, linewidth=1.4, label="angle")
    upper.set_ylim(0.0, nice_ceiling(1.05 * float(np.nanmax(angles + around))))
    shade_shadow(upper, t_s, lit)
    dress(upper, y_label="angle, deg")
    handles, _ = upper.get_legend_handles_labels()
    handles += [] if np.all(lit) else [Patch(color=SHADOW, label="Earth's shadow")]
    # Above the axes, where no curve passes.
    upper.legend(
        handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8.5, frameon=False, borderpad=0
    )

    shade_shadow(lower, t_s, lit)
    for axis, sigma in zip("xyz", attitude_sigma_deg.T, strict=True):
        lower.plot(
            t_s, sigma, color=AXIS_COLOURS[axis], linestyle=AXIS_STYLES[axis], linewidth=1.1, label=f"about {axis}"
        )
    lower.plot(
        t_s,
        np.where(known, sigma_deg, np.nan),
        color=INK,
        linewidth=1.1,
        linestyle=(0, (7, 2, 1.5, 2)),
        label="field angle",
    )
    finite = np.concatenate([attitude_sigma_deg[np.isfinite(attitude_sigma_deg)], sigma_deg[known]])
    if finite.size:
        lower.set_ylim(0.0, nice_ceiling(1.25 * float(finite.max())))
        lower.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=4,
            fontsize=8,
            frameon=False,
            borderpad=0,
            handlelength=2.6,
        )
    else:
        lower.text(0.5, 0.5, "1σ unknown", transform=lower.transAxes, ha="center", va="center", color=FAINT, fontsize=9)
    dress(lower, y_label="attitude 1σ, deg", x_label="time since epoch, s")
    lower.set_xlim(*time_limits(t_s))
    return figure
