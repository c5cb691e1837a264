"""One channel: measured against modelled readings, and the residuals in sigmas with what the fit promises for them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jaxsat.plotting.channels.timeline import Timeline, column_colours
from jaxsat.plotting.style import FAINT, INK, LEFT_OUT, QUIET, dress, head, new_figure, nice_ceiling

_DASHED = (0, (4, 2))
_HOLLOW = {"markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 0.8}

TALL_IN, LOW_IN, GAP_IN, CLOSE_IN = 1.75, 0.85, 0.38, 0.08
TOP_IN, BOTTOM_IN = 1.05, 0.5
NARROW = 3
"""Readings up to which they stand below each other; more of them stand in two columns."""


@dataclass(frozen=True)
class Words:
    """What the curves and marks of a picture are called."""

    measured: str = "measured"
    modelled: str = "modelled"
    left_out: str = "left out of the fit"
    residual: str = "resid."


@dataclass(frozen=True)
class Curve:
    """What is modelled between the samples: where a line from one to the next would cut corners."""

    t_s: np.ndarray
    modelled: np.ndarray
    """[time columns] NaN where nothing is modelled."""
    direct: np.ndarray | None = None
    """[time columns] the part of direct sunlight in it."""


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
    """[time differences] in `residual_unit`."""
    promised: np.ndarray | None
    """[time differences] 1-sigma of them by noise and covariance."""
    used: np.ndarray
    """[time] or [time differences] bool."""
    reduced: np.ndarray | None = None
    """[time differences] bool: used with much less than the usual weight."""
    direct: np.ndarray | None = None
    """[time columns] the part of direct sunlight in what is modelled."""
    notes: Sequence[str] = ()
    """A few words on each column."""
    colours: Sequence[str] = ()
    """Of the columns; by default those of their number."""
    shared: bool = False
    """Whether all columns have one scale, from zero up."""
    residual_unit: str = "σ"
    curve: Curve | None = None
    """Without one the lines join the samples."""
    words: Words = Words()

    def drawn(self) -> Curve:
        """What the lines go through."""
        return self.curve or Curve(self.t_s, self.modelled, self.direct)

    def out(self) -> np.ndarray:
        """[time differences] bool: left out."""
        used = self.used if self.used.ndim == 2 else self.used[:, None]
        return np.broadcast_to(~used, self.residual.shape)

    def light(self) -> np.ndarray:
        """[time differences] bool: weighed down as doubtful, and not left out."""
        return np.zeros(self.residual.shape, bool) if self.reduced is None else self.reduced & ~self.out()

    def column_colours(self) -> list[str]:
        """Of the columns."""
        return list(self.colours) or column_colours(len(self.columns))

    def limits(self, k: int) -> tuple[float, float] | None:
        """Lower and upper end of the scale of a column; None where nothing is known of it."""
        columns = range(len(self.columns)) if self.shared else [k]
        used = ~self.out()[:, 0] if not self.paired else None
        shown = [self.drawn().modelled[:, j] for j in columns]
        shown += [self.measured[~self.out()[:, j] if used is None else used, j] for j in columns]
        values = np.concatenate(shown)
        values = values[np.isfinite(values)]
        if not values.size:
            return None
        # A wild reading must not flatten the others: it stands outside.
        low, high = float(values.min()), float(values.max())
        if self.shared:
            top = nice_ceiling(1.02 * high)
            return min(low, 0.0) - 0.03 * top, top
        margin = 0.08 * (high - low) or 0.1 * abs(high) or 1.0
        return low - margin, high + margin

    @property
    def paired(self) -> bool:
        """Whether each column has a residual of its own."""
        return tuple(self.columns) == tuple(self.differences)

    def reach(self) -> float:
        """Residual at the edge of a chart: the largest of the readings in use, of sigmas no less than 4."""
        trusted = np.abs(self.residual[~self.out() & ~self.light()])
        trusted = trusted[np.isfinite(trusted)]
        least = 4.0 if self.residual_unit == "σ" else 0.0
        return nice_ceiling(max(least, 1.1 * float(trusted.max()) if trusted.size else 0.0))


def draw_readings(readings: Readings, timeline: Timeline, *, unit: str, title: str, subtitle: str = "") -> Figure:
    """Returns the picture: each reading with its residual below, or all residuals behind where they are of turns.

    A sample that was left out is crossed, one that was weighed down hollow; a residual off scale stands at the edge.
    The band is the promised 1-sigma.
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
    own = r.column_colours()
    colours = {"reading": own, "residual": own if r.paired else column_colours(len(r.differences))}
    width = figure.get_figwidth()
    for (kind, k), (column, top, bottom) in zip(strips, places, strict=True):
        share = (width - 0.15) / across
        box = (column * share + 0.75, height - TOP_IN - bottom, share - 0.85, bottom - top)
        axes = figure.add_axes((box[0] / width, box[1] / height, box[2] / width, box[3] / height))
        last = all(other[0] != column or other[2] <= bottom for other in places)
        if kind == "reading":
            _draw_reading(axes, r, k, colours[kind][k])
            head(axes, r.columns[k], fontweight="bold", color=colours[kind][k])
            if r.notes:
                head(axes, r.notes[k], side="right", fontsize=8, color=QUIET)
            dress(axes, y_label=unit)
            axes.locator_params(axis="y", nbins=5)
        else:
            _draw_residual(axes, r, k, colours[kind][k], limit)
            if not r.paired:
                head(axes, r.differences[k], fontweight="bold", color=colours[kind][k])
            between = " / " if r.residual_unit == "σ" else ", "
            dress(axes, y_label=f"{r.words.residual}{between}{r.residual_unit}")
        axes.tick_params(labelbottom=last)
        if last:
            axes.set_xlabel("time since epoch, s", fontsize=9, color=INK)
        timeline.dress(axes)
    handles = _legend(r) + timeline.legend()
    figure.legend(
        handles=handles,
        loc="upper left",
        ncols=len(handles),
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
    t = r.t_s
    # Turns of an attitude are left out together, and so are its components.
    out, light = (marks[:, k if r.paired else 0] for marks in (r.out(), r.light()))
    plain = ~(out | light)
    line = r.drawn()
    if line.direct is not None:
        axes.plot(line.t_s, line.direct[:, k], color=FAINT, linewidth=0.8, linestyle=_DASHED, zorder=2)
    axes.plot(line.t_s, line.modelled[:, k], color=colour, linewidth=1.4, alpha=0.75, zorder=3)
    axes.plot(t[plain], r.measured[plain, k], ".", color=INK, markersize=3.6, zorder=4)
    axes.plot(t[light], r.measured[light, k], "o", markersize=3.4, zorder=4, **_HOLLOW)
    axes.plot(t[out], r.measured[out, k], "x", color=LEFT_OUT, markersize=4.5, markeredgewidth=1.0, zorder=5)
    limits = r.limits(k)
    if limits is not None:
        axes.set_ylim(*limits)


def _draw_residual(axes: Axes, r: Readings, k: int, colour: str, limit: float) -> None:
    t, residual = r.t_s, np.clip(r.residual[:, k], -0.9 * limit, 0.9 * limit)
    out, light = r.out()[:, k], r.light()[:, k]
    plain = ~(out | light)
    if r.promised is not None:
        axes.fill_between(t, -r.promised[:, k], r.promised[:, k], color=FAINT, alpha=0.3, linewidth=0, zorder=1)
    axes.axhline(0.0, color=FAINT, linewidth=0.8, zorder=2)
    axes.plot(t[plain], residual[plain], ".", color=colour, markersize=3.4, zorder=4)
    axes.plot(t[light], residual[light], "o", markersize=3, zorder=4, **_HOLLOW)
    axes.plot(t[out], residual[out], "x", color=LEFT_OUT, markersize=4, markeredgewidth=0.9, zorder=5)
    axes.set_ylim(-limit, limit)
    axes.set_yticks([-limit / 2, 0.0, limit / 2])


def _legend(r: Readings) -> list[Artist]:
    def mark(marker: str, label: str, **style: Any) -> Line2D:
        return Line2D([], [], **{"linestyle": "none", "marker": marker, "label": label, "markersize": 6, **style})

    lines = [mark(".", r.words.measured, color=INK)]
    lines.append(Line2D([], [], color="#666666", linewidth=2, label=r.words.modelled))
    if r.direct is not None:
        lines.append(Line2D([], [], color=FAINT, linewidth=0.9, linestyle=_DASHED, label="direct sunlight alone"))
    if r.promised is not None:
        lines.append(Line2D([], [], color=FAINT, alpha=0.4, linewidth=7, label="promised ±1σ"))
    lines += [mark("o", "weighed down", **{**_HOLLOW, "markersize": 5})] if r.light().any() else []
    return [*lines, *([mark("x", r.words.left_out, color=LEFT_OUT)] if r.out().any() else [])]
