"""One channel: measured against modelled readings, and the residuals in sigmas with what the fit promises for them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jaxsat.plotting.channels.timeline import Timeline, column_colours
from jaxsat.plotting.style import FAINT, INK, LEFT_OUT, dress, head, new_figure, nice_ceiling

TALL_IN, LOW_IN, GAP_IN, CLOSE_IN = 1.75, 0.85, 0.38, 0.08
TOP_IN, BOTTOM_IN = 1.05, 0.5
NARROW = 3
"""Readings up to which they stand below each other; more of them stand in two columns."""


@dataclass(frozen=True)
class Readings:
    """Readings of a channel at its own times, in its unit."""

    t_s: np.ndarray
    columns: Sequence[str]
    measured: np.ndarray
    """[time columns]; NaN where nothing was measured."""
    modelled: np.ndarray
    differences: Sequence[str]
    """What the residuals are of: the columns, or three small turns of an attitude."""
    residual: np.ndarray
    """[time differences] in sigmas."""
    promised: np.ndarray
    """[time differences] 1-sigma of them by noise and covariance."""
    used: np.ndarray
    """[time] bool."""

    @property
    def paired(self) -> bool:
        """Whether each column has a residual of its own."""
        return tuple(self.columns) == tuple(self.differences)

    def reach(self) -> float:
        """Residual at the edge of a chart [sigmas]: that of the readings in use, but no less than 4."""
        return reach(self.residual, self.used)


def reach(residual: np.ndarray, used: np.ndarray) -> float:
    """Returns the scale of residuals [time differences]: the largest of those `used` [time], 4 at the least."""
    trusted = np.abs(residual[used])
    trusted = trusted[np.isfinite(trusted)]
    return nice_ceiling(max(4.0, 1.1 * float(trusted.max()) if trusted.size else 0.0))


def draw_readings(readings: Readings, timeline: Timeline, *, unit: str, title: str, subtitle: str = "") -> Figure:
    """Returns the picture: each reading with its residual below, or all residuals behind where they are of turns.

    A sample that was left out is crossed; a residual off scale stands at the edge. The band is the promised 1-sigma.
    """
    r, limit = readings, readings.reach()
    strips = [("reading", k) for k in range(len(r.columns))]
    strips = [s for k in range(len(r.columns)) for s in (("reading", k), ("residual", k))] if r.paired else strips
    if not r.paired:
        strips += [("residual", k) for k in range(len(r.differences))]
    across = 1 if len(r.columns) <= NARROW or not r.paired else 2
    places = _places(strips, across, r.paired)
    height = TOP_IN + BOTTOM_IN + max(bottom for _, _, bottom in places)
    figure = new_figure(5.6 * across + 3.8 * (across == 1), height, title, subtitle)
    colours = {"reading": column_colours(len(r.columns)), "residual": column_colours(len(r.differences))}
    width = figure.get_figwidth()
    for (kind, k), (column, top, bottom) in zip(strips, places, strict=True):
        share = (width - 0.15) / across
        box = (column * share + 0.75, height - TOP_IN - bottom, share - 0.85, bottom - top)
        axes = figure.add_axes((box[0] / width, box[1] / height, box[2] / width, box[3] / height))
        last = all(other[0] != column or other[2] <= bottom for other in places)
        if kind == "reading":
            _draw_reading(axes, r, k, colours[kind][k])
            head(axes, r.columns[k], fontweight="bold", color=colours[kind][k])
            dress(axes, y_label=unit)
            axes.locator_params(axis="y", nbins=5)
        else:
            _draw_residual(axes, r, k, colours[kind][k], limit)
            if not r.paired:
                head(axes, r.differences[k], fontweight="bold", color=colours[kind][k])
            dress(axes, y_label="resid. / σ")
        axes.tick_params(labelbottom=last)
        if last:
            axes.set_xlabel("time since epoch, s", fontsize=9, color=INK)
        timeline.dress(axes)
    crossed = not r.used.all()
    figure.legend(
        handles=_legend(crossed) + timeline.legend(),
        loc="upper left",
        ncols=6,
        fontsize=8.5,
        frameon=False,
        bbox_to_anchor=(0.002, 1.0 - 0.52 / height),
        handletextpad=0.5,
        columnspacing=1.6,
    )
    return figure


def _places(strips: Sequence[tuple[str, int]], across: int, paired: bool) -> list[tuple[int, float, float]]:
    """Column, upper and lower edge [in] of each strip: readings fill the columns in turn, residuals follow theirs."""
    places: list[tuple[int, float, float]] = []
    top, column = [0.0] * across, -1
    for kind, _ in strips:
        if kind == "reading" or not paired:
            column = (column + 1) % across
        begin, tall = top[column], TALL_IN if kind == "reading" else LOW_IN
        places.append((column, begin, begin + tall))
        top[column] = begin + tall + (CLOSE_IN if kind == "reading" and paired else GAP_IN)
    return places


def _draw_reading(axes: Axes, r: Readings, k: int, colour: str) -> None:
    t, out = r.t_s, ~r.used
    axes.plot(t, r.modelled[:, k], color=colour, linewidth=1.4, alpha=0.75, zorder=3)
    axes.plot(t[r.used], r.measured[r.used, k], ".", color=INK, markersize=3.6, zorder=4)
    axes.plot(t[out], r.measured[out, k], "x", color=LEFT_OUT, markersize=4.5, markeredgewidth=1.0, zorder=5)
    shown = np.concatenate([r.modelled[:, k], r.measured[r.used, k]])
    shown = shown[np.isfinite(shown)]
    if shown.size:
        # A wild reading must not flatten the others: it stands outside.
        low, high = float(shown.min()), float(shown.max())
        margin = 0.08 * (high - low) or 0.1 * abs(high) or 1.0
        axes.set_ylim(low - margin, high + margin)


def _draw_residual(axes: Axes, r: Readings, k: int, colour: str, limit: float) -> None:
    t, residual, out = r.t_s, np.clip(r.residual[:, k], -0.9 * limit, 0.9 * limit), ~r.used
    axes.fill_between(t, -r.promised[:, k], r.promised[:, k], color=FAINT, alpha=0.3, linewidth=0, zorder=1)
    axes.axhline(0.0, color=FAINT, linewidth=0.8, zorder=2)
    axes.plot(t[r.used], residual[r.used], ".", color=colour, markersize=3.4, zorder=4)
    axes.plot(t[out], residual[out], "x", color=LEFT_OUT, markersize=4, markeredgewidth=0.9, zorder=5)
    axes.set_ylim(-limit, limit)
    axes.set_yticks([-limit / 2, 0.0, limit / 2])


def _legend(crossed: bool) -> list[Artist]:
    def mark(marker: str, label: str, colour: str) -> Line2D:
        return Line2D([], [], linestyle="none", marker=marker, label=label, color=colour, markersize=6)

    lines = [mark(".", "measured", INK), Line2D([], [], color="#666666", linewidth=2, label="modelled")]
    lines.append(Line2D([], [], color=FAINT, alpha=0.4, linewidth=7, label="promised ±1σ"))
    return [*lines, *([mark("x", "left out of the fit", LEFT_OUT)] if crossed else [])]
