"""Picture of skCUBE's currents beside what the motion by its Sun sensors makes of them, one row a pass."""

from pathlib import Path

import numpy as np

from jaxsat.plotting.style import PANEL_COLOURS, PANEL_NAMES, SHADOW, dress, head, new_figure, png_bytes

FINE_S = 2.0


def draw_skcube(path: Path, flown) -> None:
    """Writes the PNG of the passes: currents over time, and measured over predicted ones in full Sun."""
    title = "skCUBE: currents that no fit has seen"
    figure = new_figure(
        9.0, 2.6 * len(flown) + 0.8, title, "lines: by all other sensors; dots: measured; shaded: full Sun"
    )
    rows = figure.subplots(len(flown), 2, squeeze=False, gridspec_kw={"width_ratios": [3.0, 1.0]})
    figure.subplots_adjust(left=0.07, right=0.98, top=1.0 - 0.9 / (2.6 * len(flown) + 0.8), bottom=0.07, hspace=0.45)
    for (time, scatter), each in zip(rows, flown, strict=True):
        cells = each.fit.result.channels["cells"]
        scale = 1.0 if each.early is None else each.early.largest_ma / 500.0
        t = np.arange(cells.t_s[0], cells.t_s[-1] + FINE_S, FINE_S)
        fine, _ = each.fit.predict("cells", t)
        for k, name in enumerate(PANEL_NAMES):
            time.plot(t, scale * fine[:, k], lw=0.8, color=PANEL_COLOURS[name])
            time.plot(cells.t_s, cells.measured[:, k], "o", ms=3.0, color=PANEL_COLOURS[name], label=name)
            part = each.full_sun
            x = scale * cells.modelled[:, k]
            scatter.plot(x[part], cells.measured[part, k], "o", ms=3.0, color=PANEL_COLOURS[name])
            scatter.plot(x[~part], cells.measured[~part, k], "x", ms=3.0, color=PANEL_COLOURS[name], alpha=0.5)
        if each.full_sun.any():
            time.axvspan(t[0], cells.t_s[each.full_sun][-1], color=SHADOW, lw=0, zorder=0)
        told = [f"{each.flown.name}: {each.fit.verdict}"]
        if each.early is not None:
            told.append(f"full Sun r = {each.early.correlation:.3f}")
        if each.later is not None:
            told.append(f"later r = {each.later.correlation:.3f}")
        head(time, ", ".join(told))
        head(scatter, "measured over predicted")
        dress(time, y_label="mA")
        dress(scatter)
        scatter.plot([0.0, 550.0], [0.0, 550.0], lw=0.6, color="0.6")
    rows[0][0].legend(fontsize=7, ncols=6, loc="upper right", frameon=False)
    rows[-1][0].set_xlabel("s after the first frame", fontsize=9)
    path.write_bytes(png_bytes(figure))
