"""What limits accuracy, drawn: bars of each number, sigma along the arc, sigma over arc length and interval."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from fitting.sensitivity.analysis import Sensitivity
from jaxsat.plotting.style import FAINT, INK, MAIN, dress, head, new_figure, png_bytes, shade_shadow, time_limits

NOISE, ASSUMED, PRIOR = MAIN, "#d98e00", "#b9c0ca"
MOST_BARS = 40
"""Numbers in one picture."""
BAR_IN = 0.21
LEVELS = 9
PLAIN = FuncFormatter(lambda x, _: f"{x:g}")
"""Numbers of a logarithmic axis as they are."""


def draw_sensitivity(found: Sensitivity, subtitle: str) -> dict[str, bytes]:
    """PNG content by file name."""
    drawn = {"limits.png": limits(found, subtitle)}
    if found.vantage.free_motion:
        drawn["arc.png"] = along_arc(found, subtitle)
    if found.sampling is not None and min(found.sampling.samples.shape) > 1:
        drawn["sampling.png"] = over_sampling(found, subtitle)
    return {name: png_bytes(figure) for name, figure in drawn.items()}


def limits(found: Sensitivity, subtitle: str) -> Figure:
    """Bars of each number: sigma over its prior one, from noise and from what is assumed; shares of the channels."""
    rows = [row for row in found.quoted.rows if row.prior is not None][:MOST_BARS]
    shares = found.contributions.channels
    count, low = max(len(rows), 1), max(len(shares) + 1, 2)
    height = 0.95 + BAR_IN * (count + low) + 1.05
    figure = new_figure(8.6, height, "What limits accuracy", subtitle)
    upper = figure.add_axes((0.24, 1.0 - (0.75 + BAR_IN * count) / height, 0.72, BAR_IN * count / height))
    place = np.arange(len(rows))
    noise = np.array([row.sigma_noise / row.prior for row in rows if row.prior], float)
    assumed = np.array([row.sigma_assumed / row.prior for row in rows if row.prior], float)
    shown = np.concatenate([noise[np.isfinite(noise)], assumed[assumed > 0.0], [1.0]])
    left = 10.0 ** np.floor(np.log10(max(float(shown.min()), 1e-6)) - 0.3)
    bars = [(place - 0.2, noise, NOISE, "from noise")]
    if found.choice.considered:
        bars.append((place + 0.2, assumed, ASSUMED, "from what is assumed"))
    for y, x, colour, label in bars:
        upper.barh(y, np.where(np.isfinite(x), x, 1e3) - left, left=left, height=0.38, color=colour, label=label)
    upper.axvline(1.0, color=INK, linewidth=0.8)
    upper.set_xscale("log")
    upper.set_xlim(left, max(2.0, 1.5 * float(shown.max())))
    upper.set_ylim(len(rows) - 0.4, -0.6)
    upper.set_yticks(place, [row.name for row in rows])
    dress(upper, x_label="1-sigma over that of the prior")
    # Above the bars, which may reach everywhere.
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, frameon=False)
    lower = figure.add_axes((0.24, 0.5 / height, 0.72, BAR_IN * low / height))
    names, values = [each.name for each in shares], [100.0 * each.share for each in shares]
    if found.contributions.priors > 5e-4:
        names, values = [*names, "priors"], [*values, 100.0 * found.contributions.priors]
    lower.barh(np.arange(len(names)), values, height=0.6, color=[PRIOR if n == "priors" else NOISE for n in names])
    lower.set_yticks(np.arange(len(names)), names)
    lower.set_ylim(len(names) - 0.4, -0.6)
    dress(lower, x_label="share of what is told about all numbers, %")
    return figure


def along_arc(found: Sensitivity, subtitle: str) -> Figure:
    """Sigma of the attitude over the arc, and what each part of it tells."""
    t, (noise, assumed) = found.vantage.samples.t, found.attitude_sigma_deg
    figure = new_figure(8.6, 5.0, "Attitude along the arc", subtitle)
    upper, lower = figure.subplots(
        2, 1, sharex=True, gridspec_kw={"left": 0.09, "right": 0.975, "top": 0.83, "bottom": 0.1, "hspace": 0.28}
    )
    _shade(upper, found)
    _shade(lower, found)
    upper.plot(t, noise, color=NOISE, linewidth=1.4, label="from noise")
    if found.choice.considered:
        upper.plot(t, assumed, color=ASSUMED, linewidth=1.4, label="from what is assumed")
        upper.plot(t, np.hypot(noise, assumed), color=INK, linewidth=0.9, linestyle=(0, (4, 3)), label="both")
        upper.set_yscale("log")
        upper.yaxis.set_major_formatter(PLAIN)
        upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8, frameon=False)
    dress(upper, y_label="1-sigma, deg")
    head(upper, "1-sigma of the attitude, three axes together")
    parts, edges = found.contributions.parts, np.linspace(t[0], t[-1], len(found.contributions.parts) + 1)
    lower.bar(
        edges[:-1], [100.0 * p.share for p in parts], np.diff(edges), align="edge", color=NOISE, edgecolor="white"
    )
    lower.set_xlim(*time_limits(t))
    dress(lower, x_label="time, s", y_label="%")
    head(lower, "share of what each part of the arc tells")
    return figure


def over_sampling(found: Sensitivity, subtitle: str) -> Figure:
    """Contours over arc length and interval: of the attitude, and of the worst known number that data tell."""
    own = found.sampling
    assert own is not None
    figure = new_figure(8.6, 4.2, "Arc length and sampling interval", subtitle)
    axes = figure.subplots(
        1, 2, gridspec_kw={"left": 0.08, "right": 0.975, "top": 0.82, "bottom": 0.13, "wspace": 0.25}
    )
    chosen = [(np.degrees(own.sigmas.attitude), "attitude, deg RMS")] if found.vantage.free_motion else []
    rows = found.quoted.rows
    ratio = [row.sigma_noise / row.prior if row.prior else -1.0 for row in rows]
    for k in sorted(range(len(rows)), key=lambda k: -ratio[k] if ratio[k] < 0.7 else 0.0)[: 2 - len(chosen)]:
        chosen.append(
            (own.sigmas.total[..., k], rows[k].name if rows[k].unit == "1" else f"{rows[k].name}, {rows[k].unit}")
        )
    for each, (values, title) in zip(axes, chosen, strict=False):
        _contours(each, own.arcs_s, own.intervals_s, values)
        head(each, f"1-sigma: {title}")
        dress(each, x_label="arc, s", y_label="interval, s")
    return figure


def _contours(axes: Axes, arcs: np.ndarray, intervals: np.ndarray, values: np.ndarray) -> None:
    z = np.log10(np.where(np.isfinite(values) & (values > 0.0), values, np.nan)).T
    inside = z[np.isfinite(z)]
    axes.set_yscale("log", base=2)
    axes.yaxis.set_major_formatter(PLAIN)
    if inside.size < 4 or float(np.ptp(inside)) < 1e-6:
        axes.text(0.5, 0.5, "the same everywhere", ha="center", color=FAINT, transform=axes.transAxes)
        return
    levels = _levels(float(inside.min()), float(inside.max()))
    axes.contourf(arcs, intervals, np.ma.masked_invalid(z), levels, cmap="Blues", extend="both")
    lines = axes.contour(
        arcs, intervals, np.ma.masked_invalid(z), levels, colors=INK, linewidths=0.6, linestyles="solid"
    )
    axes.clabel(lines, fmt=lambda x: f"{10.0**x:.3g}", fontsize=7)


def _levels(low: float, high: float) -> np.ndarray:
    """Decimal logarithms of 1, 2, 5 times powers of ten between two, or of even steps where there are too few."""
    decades = np.arange(np.floor(low), np.ceil(high) + 1.0)
    round_ones = np.sort((decades[:, None] + np.log10([1.0, 2.0, 5.0])).ravel())
    inside = round_ones[(round_ones > low) & (round_ones < high)]
    if len(inside) < 3:
        return np.linspace(low, high, LEVELS)[1:-1]
    return inside[:: -(-len(inside) // LEVELS)]


def _shade(axes: Axes, found: Sensitivity) -> None:
    light = found.vantage.problem.sky.light
    if light is not None:
        valid = np.asarray(found.vantage.problem.valid)
        shade_shadow(axes, found.vantage.samples.t, np.asarray(light.illumination)[valid] > 0.5)
