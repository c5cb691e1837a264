"""Pictures of what cleaning did: coordinates, magnetometers and currents before and after, orbit residuals."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxsat.plotting.style import (
    AXIS_COLOURS,
    LEFT_OUT,
    PANEL_COLOURS,
    PANEL_NAMES,
    dress,
    head,
    new_figure,
    shade_shadow,
    time_limits,
)
from jaxsat.significant import count_text

TIME_LABEL = "time since epoch, s"


def draw_coordinates(
    raw_t_s: np.ndarray, raw_position_km: np.ndarray, t_s: np.ndarray, position_km: np.ndarray, *, subtitle: str = ""
) -> Figure:
    """Returns positions [row 3] as received above those [time 3] after cleaning, inertial axes."""
    return _before_and_after(
        (raw_t_s, raw_position_km),
        (t_s, position_km),
        list(zip("XYZ", AXIS_COLOURS.values(), strict=True)),
        title="Coordinates",
        unit="km",
        subtitle=subtitle,
    )


def draw_magnetometers(
    raw_t_s: np.ndarray, raw_field_uT: np.ndarray, t_s: np.ndarray, field_uT: np.ndarray, *, subtitle: str = ""
) -> Figure:
    """Returns magnetometer readings By, Bz [row 2] as received above those after cleaning (NaN: no reading)."""
    return _before_and_after(
        (raw_t_s, raw_field_uT),
        (t_s, field_uT),
        [("By", AXIS_COLOURS["y"]), ("Bz", AXIS_COLOURS["z"])],
        title="Magnetometers",
        unit="µT, body axes",
        subtitle=subtitle,
    )


def draw_panel_currents(
    raw_t_s: np.ndarray,
    raw_currents_mA: np.ndarray,
    t_s: np.ndarray,
    currents_mA: np.ndarray,
    *,
    raw_used: np.ndarray | None = None,
    lit: np.ndarray | None = None,
    subtitle: str = "",
) -> Figure:
    """Returns currents [row 6] as received above those after cleaning.

    Rows that went into no sample (`raw_used` false) are crossed out, the shadow is shaded where `lit` [time] is given.
    """
    figure = _before_and_after(
        (raw_t_s, raw_currents_mA),
        (t_s, currents_mA),
        [(name, PANEL_COLOURS[name]) for name in PANEL_NAMES],
        title="Panel currents",
        unit="mA",
        subtitle=subtitle,
    )
    if raw_used is not None:
        upper, (low, high) = figure.axes[0], figure.axes[0].get_ylim()
        rows, panels = np.nonzero(~raw_used[:, None] & (raw_currents_mA > low) & (raw_currents_mA < high))
        upper.plot(raw_t_s[rows], raw_currents_mA[rows, panels], "x", color=LEFT_OUT, markersize=6)
    if lit is not None:
        for axes in figure.axes:
            shade_shadow(axes, t_s, lit, label=True)
    return figure


def draw_orbit_residuals(t_s: np.ndarray, before_km: np.ndarray, after_km: np.ndarray, *, subtitle: str = "") -> Figure:
    """Returns measured minus computed positions [time 3], km: for the first elements above, the fitted ones below."""
    figure = new_figure(11.0, 6.4, "Orbit: measured minus computed position", subtitle)
    axes_pair = figure.subplots(2, 1, sharex=True, gridspec_kw=_FRAME)
    for axes, (name, residual) in zip(axes_pair, zip(ORBIT_STAGES, (before_km, after_km), strict=True), strict=True):
        _draw_residual(axes, t_s, residual, name)
    axes_pair[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8.5, frameon=False)
    axes_pair[1].set_xlabel(TIME_LABEL, fontsize=9)
    axes_pair[1].set_xlim(*time_limits(t_s))
    return figure


ORBIT_STAGES = ("first elements, from energy, area and Laplace integrals", "after least squares")


def draw_orbit_stage(
    t_s: np.ndarray, residual_km: np.ndarray, doubtful: np.ndarray, *, stage: str, subtitle: str = ""
) -> Figure:
    """Returns measured minus computed positions [time 3], km, of one of `ORBIT_STAGES` (Penkov et al. 2009, figs. 7-8).

    Those that are `doubtful` [time] are crossed out; the scale is that of the others.
    """
    figure = new_figure(11.0, 4.2, "Orbit: measured minus computed position", subtitle)
    axes = figure.add_axes((0.085, 0.12, 0.9, 0.68))
    kept = np.where(doubtful[:, None], np.nan, residual_km)
    _draw_residual(axes, t_s, kept, stage)
    low, high = axes.get_ylim()
    shown = np.clip(residual_km, 0.94 * low, 0.94 * high)
    for number in range(3):
        axes.plot(t_s[doubtful], shown[doubtful, number], "x", color=LEFT_OUT, markersize=6)
    axes.plot([], [], "x", color=LEFT_OUT, label=f"doubtful, left out: {count_text(int(doubtful.sum()), 'point')}")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=8.5, frameon=False)
    axes.set_xlabel(TIME_LABEL, fontsize=9)
    axes.set_xlim(*time_limits(t_s))
    return figure


def _draw_residual(axes: Axes, t_s: np.ndarray, residual: np.ndarray, name: str) -> None:
    axes.axhline(0.0, color="#8a8f98", linewidth=0.8)
    for number, (axis, colour) in enumerate(AXIS_COLOURS.items()):
        axes.plot(
            t_s, residual[:, number], f"{MARKS[number]}-", color=colour, linewidth=0.9, markersize=3, label=axis.upper()
        )
    rms = float(np.sqrt(np.nanmean(residual**2)))
    head(axes, f"{name}: RMS {rms:.3g} km per axis")
    reach = 1.12 * float(np.nanmax(np.abs(residual))) or 1.0
    axes.set_ylim(-reach, reach)
    dress(axes, y_label="km")


_FRAME = {"left": 0.085, "right": 0.985, "top": 0.86, "bottom": 0.075, "hspace": 0.22}

MARKS = "osd^vP"
"""Of columns, beside their colours."""

Series = tuple[np.ndarray, np.ndarray]
"""Times [s] and values [time column]."""


def _before_and_after(
    before: Series, after: Series, columns: Sequence[tuple[str, str]], *, title: str, unit: str, subtitle: str
) -> Figure:
    """Two pictures on one scale, that of the cleaned data: what it cannot hold stands at the edge, counted."""
    figure = new_figure(11.0, 6.4, title, subtitle)
    upper, lower = figure.subplots(2, 1, sharex=True, sharey=True, gridspec_kw=_FRAME)
    span = time_limits(after[0])
    low, high = float(np.nanmin(after[1], initial=np.inf)), float(np.nanmax(after[1], initial=-np.inf))
    if not np.isfinite([low, high]).all():
        low, high = -1.0, 1.0
    margin = 0.12 * (high - low) or 1.0
    limits = (low - margin, high + margin)
    for number, (name, colour) in enumerate(columns):
        mark = MARKS[number % len(MARKS)]
        upper.plot(before[0], before[1][:, number], mark, color=colour, markersize=3, alpha=0.8)
        lower.plot(after[0], after[1][:, number], f"{mark}-", color=colour, markersize=3, linewidth=0.9, label=name)
    above, elsewhere = _mark_off_scale(upper, before, span, limits)
    dress(upper, y_label=unit)
    dress(lower, y_label=unit, x_label=TIME_LABEL)
    lower.set_xlim(*span)
    lower.set_ylim(*limits)
    notes = [f"as received: {count_text(len(before[0]), 'row')}"]
    notes += [f"{count_text(above, 'value')} off scale (triangles)"] if above else []
    notes += [f"{count_text(elsewhere, 'row')} of another time not shown"] if elsewhere else []
    head(upper, ", ".join(notes))
    head(lower, f"after cleaning: {count_text(len(after[0]), 'sample')}")
    figure.legend(
        *lower.get_legend_handles_labels(),
        loc="upper right",
        ncols=len(columns),
        fontsize=9,
        frameon=False,
        bbox_to_anchor=(0.99, 0.985),
    )
    return figure


def _mark_off_scale(
    axes: Axes, series: Series, span: tuple[float, float], limits: tuple[float, float]
) -> tuple[int, int]:
    """Triangles at the edge for values off scale; returns their number and that of the rows outside the time axis."""
    t_s, values = series
    shown = (t_s >= span[0]) & (t_s <= span[1])
    inset = 0.03 * (limits[1] - limits[0])
    count = 0
    for marker, beyond, edge in (
        ("^", values > limits[1], limits[1] - inset),
        ("v", values < limits[0], limits[0] + inset),
    ):
        rows, _ = np.nonzero(beyond & shown[:, None])
        axes.plot(t_s[rows], np.full(len(rows), edge), marker, color=LEFT_OUT, markersize=5, zorder=5)
        count += len(rows)
    return count, int(np.sum(~shown))
