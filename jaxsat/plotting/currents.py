"""Measured against modelled currents of the six panels, with the residuals below each."""

from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from jaxsat.plotting.current_marks import current_marks
from jaxsat.plotting.style import (
    FAINT,
    INK,
    LEFT_OUT,
    PANEL_COLOURS,
    PANEL_NAMES,
    SHADOW,
    dress,
    head,
    new_figure,
    nice_ceiling,
    shade_shadow,
    time_limits,
)


def draw_currents(
    t_s: np.ndarray,
    measured_mA: np.ndarray,
    modelled_mA: np.ndarray,
    direct_mA: np.ndarray,
    *,
    weight: np.ndarray,
    lit: np.ndarray,
    limited: np.ndarray | None = None,
    title: str = "Panel currents",
    subtitle: str = "",
) -> Figure:
    """Returns the picture of a fit's currents [time 6], panels +X -X +Y -Y +Z -Z; `lit` and `limited` are [time].

    All panels share one scale, and so do all residuals. A current is crossed out where its weight is zero or the whole
    sample was found `limited`, hollow where its weight is below half of the median one (so weighted down as doubtful);
    a residual off scale stands as a triangle at the edge.
    """
    lit = np.asarray(lit, bool)
    sample_out = np.zeros(len(t_s), bool) if limited is None else np.asarray(limited, bool)
    marks = current_marks(measured_mA, weight, lit, sample_out)
    left_out, used, reduced = marks.left_out, marks.used, marks.reduced
    residual = measured_mA - modelled_mA
    trusted = np.abs(residual[used & ~reduced])
    reach = nice_ceiling(1.1 * float(trusted.max())) if trusted.size else 1.0
    top = nice_ceiling(1.02 * float(np.nanmax([np.nanmax(measured_mA), np.nanmax(modelled_mA), 1.0])))

    figure = new_figure(11.0, 9.2, title, subtitle)
    grid = figure.add_gridspec(8, 2, height_ratios=[3, 1.15, 0.42] * 2 + [3, 1.15], **_FRAME)
    for number, name in enumerate(PANEL_NAMES):
        row, column, last = 3 * (number // 2), number % 2, number >= 4
        main, below = figure.add_subplot(grid[row, column]), figure.add_subplot(grid[row + 1, column])
        panel = _Panel(
            PANEL_COLOURS[name],
            t_s,
            *(array[:, number] for array in (measured_mA, modelled_mA, direct_mA, residual, left_out, used, reduced)),
        )
        _draw_panel(main, panel)
        _draw_residual(below, panel, reach)
        head(main, name, fontsize=11, fontweight="bold", color=panel.colour)
        head(main, panel.summary(), side="right", fontsize=8, color="#555b66")
        main.set_ylim(-0.03 * top, top)
        main.locator_params(axis="y", nbins=4)
        main.tick_params(labelbottom=False)
        below.tick_params(labelbottom=last)
        dress(main, y_label="mA" if column == 0 else "")
        dress(below, y_label="resid., mA" if column == 0 else "", x_label="time since epoch, s" if last else "")
        for axes in (main, below):
            shade_shadow(axes, t_s, lit, label=axes is main and number < 2)
            axes.set_xlim(*time_limits(t_s))
    off_scale = bool((np.abs(residual[left_out | reduced]) > reach).any())
    _add_legend(figure, {"x": bool(left_out.any()), "o": bool(reduced.any()), "^": off_scale, "shadow": not lit.all()})
    return figure


_FRAME = {"left": 0.06, "right": 0.99, "top": 0.885, "bottom": 0.055, "hspace": 0.07, "wspace": 0.09}


@dataclass(frozen=True)
class _Panel:
    """One panel's currents [mA], residuals and masks, all [time]."""

    colour: str
    t_s: np.ndarray
    measured: np.ndarray
    modelled: np.ndarray
    direct: np.ndarray
    residual: np.ndarray
    left_out: np.ndarray
    used: np.ndarray
    reduced: np.ndarray

    def summary(self) -> str:
        """The unweighted RMS of what was used, and how much that is."""
        parts = ["nothing used"]
        if self.used.any():
            parts = [f"residual RMS {np.sqrt(np.mean(self.residual[self.used] ** 2)):.2f} mA, {self.used.sum()} used"]
        if self.left_out.any():
            parts.append(f"{self.left_out.sum()} left out")
        return ", ".join(parts)


def _draw_panel(axes: Axes, panel: _Panel) -> None:
    t, plain, out = panel.t_s, ~(panel.left_out | panel.reduced), panel.left_out
    axes.plot(t, panel.direct, color=FAINT, linewidth=0.8, linestyle=_DASHED, zorder=2)
    axes.plot(t, panel.modelled, color=panel.colour, linewidth=1.5, alpha=0.75, zorder=3)
    axes.plot(t[plain], panel.measured[plain], ".", color=INK, markersize=4.2, zorder=4)
    axes.plot(t[panel.reduced], panel.measured[panel.reduced], "o", markersize=3.4, zorder=4, **_HOLLOW)
    axes.plot(t[out], panel.measured[out], "x", color=LEFT_OUT, markersize=5, markeredgewidth=1.1, zorder=5)


def _draw_residual(axes: Axes, panel: _Panel, reach: float) -> None:
    t, residual, colour = panel.t_s, panel.residual, panel.colour
    inside = np.abs(residual) <= reach
    plain, reduced, out = panel.used & ~panel.reduced, panel.reduced & inside, panel.left_out & inside
    axes.axhline(0.0, color=FAINT, linewidth=0.8, zorder=2)
    axes.vlines(t[plain], 0.0, residual[plain], color=colour, linewidth=1.0, alpha=0.6, zorder=3)
    axes.plot(t[plain], residual[plain], ".", color=colour, markersize=3.6, zorder=4)
    axes.plot(t[reduced], residual[reduced], "o", markersize=3, zorder=4, **_HOLLOW)
    axes.plot(t[out], residual[out], "x", color=LEFT_OUT, markersize=4, markeredgewidth=0.9, zorder=4)
    for marker, beyond, edge in (("^", residual > reach, 0.88), ("v", residual < -reach, -0.88)):
        for kind, shade in ((panel.left_out, LEFT_OUT), (panel.reduced, INK)):
            where = beyond & kind
            axes.plot(t[where], np.full(where.sum(), edge * reach), marker, color=shade, markersize=4, zorder=4)
    axes.set_ylim(-reach, reach)
    axes.set_yticks([-reach / 2, 0.0, reach / 2])


_DASHED = (0, (4, 2))
_HOLLOW = {"markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 0.8}


def _add_legend(figure: Figure, present: dict[str, bool]) -> None:
    """One legend for all panels, with the marks that are `present` only."""

    def mark(marker: str, label: str, **style) -> Line2D:
        look = {"linestyle": "none", "markersize": 6, "color": INK, **style}
        return Line2D([], [], marker=marker, label=label, **look)

    handles: list[Artist] = [
        mark(".", "measured", markersize=7),
        Line2D([], [], color="#666666", linewidth=2, label="modelled (panel's colour)"),
        Line2D([], [], color=FAINT, linewidth=0.9, linestyle=_DASHED, label="direct sunlight alone"),
    ]
    handles += [mark("o", "weighted down", **{**_HOLLOW, "markersize": 5})] if present["o"] else []
    handles += [mark("x", "left out of the fit", color=LEFT_OUT)] if present["x"] else []
    handles += [mark("^", "residual off scale", color="#666666", markersize=5)] if present["^"] else []
    handles += [Patch(color=SHADOW, label="Earth's shadow")] if present["shadow"] else []
    figure.legend(
        handles=handles,
        loc="upper left",
        ncols=len(handles),
        fontsize=8.5,
        frameon=False,
        bbox_to_anchor=(0.002, 0.945),
        handletextpad=0.5,
        columnspacing=1.6,
    )
