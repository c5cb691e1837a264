"""A satellite turned about an axis: what each angle leaves of the measured currents, and the currents themselves."""

import numpy as np
from matplotlib.figure import Figure

from jaxsat.plotting.style import INK, LEFT_OUT, PANEL_COLOURS, QUIET, dress, head, new_figure


def draw_turn(
    angle_deg: np.ndarray,
    rms_mA: np.ndarray,
    modelled_mA: np.ndarray,
    measured_mA: np.ndarray,
    *,
    chosen_deg: float,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Returns the picture of a turn: residuals [angles] and currents [angles 6] against the `measured_mA` [6]."""
    figure = new_figure(11.0, 7.4, title, subtitle)
    grid = figure.add_gridspec(3, 2, height_ratios=[1.3, 1, 1], **_FRAME)
    upper = figure.add_subplot(grid[0, :])
    upper.plot(angle_deg, rms_mA, color=INK, linewidth=1.4)
    upper.set_ylim(0.0, 1.08 * float(np.max(rms_mA)) or 1.0)
    head(upper, "residual RMS of six currents, mA")
    all_axes = [upper]
    top = 1.1 * max(float(np.max(modelled_mA)), float(np.max(measured_mA)), 1.0)
    for number, pair in enumerate(("X", "Y", "Z")):
        axes = figure.add_subplot(grid[1 + number // 2, number % 2])
        for side, sign in enumerate("+-"):
            k, name = 2 * number + side, f"{sign}{pair}"
            axes.plot(angle_deg, modelled_mA[:, k], color=PANEL_COLOURS[name], linewidth=1.4, label=name)
            axes.axhline(measured_mA[k], color=PANEL_COLOURS[name], linewidth=1.0, linestyle=(0, (4, 3)))
        axes.set_ylim(-0.03 * top, top)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, fontsize=8.5, frameon=False)
        head(axes, f"{pair} panels, mA: modelled, and measured (dashed)")
        all_axes.append(axes)
    for axes in all_axes:
        axes.axvline(chosen_deg % 360.0, color=LEFT_OUT, linewidth=1.0)
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(np.arange(0.0, 361.0, 45.0))
        dress(axes, x_label="" if axes is upper else "turn, deg")
    note = f"red: the angle shown, {chosen_deg:.4g} deg\n\nThe satellite keeps its axis and turns about it;\n"
    note += "the factors of direct and returned light are\nthe best ones at each angle."
    figure.text(0.56, 0.24, note, fontsize=9, color=QUIET, va="center")
    return figure


_FRAME = {"left": 0.06, "right": 0.985, "top": 0.87, "bottom": 0.075, "hspace": 0.42, "wspace": 0.1}
