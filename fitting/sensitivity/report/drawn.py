"""Scenarios as JSON and picture: percentiles, by spin rate and by the Sun's angle to the orbit's plane."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fitting.sensitivity.report.pictures import ASSUMED, NOISE, PLAIN
from fitting.sensitivity.scenarios.many import Scenarios
from jaxsat.plotting.style import dress, head, new_figure

PERCENTILES = (5, 50, 95)
BINS = 8
LEAST_IN_BIN = 20
"""Scenarios below which no percentile of a bin is told."""


def scenarios_document(found: Scenarios) -> dict[str, Any]:
    """What sensitivity.json says of them."""
    attitude = found.attitude_deg
    rates, suns = _edges(found.rate_deg_s), _edges(found.sun_deg)
    return {
        "count": found.draws.count,
        "seed": found.draws.seed,
        "days": found.draws.days,
        "spin_deg_s": [found.draws.slowest_deg_s, found.draws.fastest_deg_s],
        "instants": len(np.unique(found.instant_s)),
        "spread": list(found.spread),
        "seconds": found.seconds,
        "scenarios_per_s": found.timed / found.seconds if found.timed else None,
        "without_attitude": int((~np.isfinite(attitude)).sum()),
        "attitude_rms_deg": _percentiles(attitude),
        "attitude_rms_deg_assumed": _percentiles(found.attitude_assumed_deg),
        "sigma": {
            name: {"unit": unit, **_percentiles(found.sigma[:, k])}
            for k, (name, unit) in enumerate(zip(found.names, found.units, strict=True))
        },
        "by_spin_deg_s": _binned(found.rate_deg_s, rates, attitude),
        "by_sun_deg": _binned(found.sun_deg, suns, attitude),
        "by_share_in_sunlight": _binned(found.lit, _edges(found.lit), attitude),
    }


def draw_scenarios(found: Scenarios, subtitle: str) -> Figure:
    """Attitude over spin rate with its spread, and over the Sun's angle and the share of sunlight."""
    figure = new_figure(8.6, 4.2, f"{found.draws.count} scenarios", subtitle)
    left, right = figure.subplots(
        1, 2, gridspec_kw={"left": 0.08, "right": 0.975, "top": 0.82, "bottom": 0.13, "wspace": 0.25}
    )
    attitude = found.attitude_deg
    edges, suns = _edges(found.rate_deg_s), _edges(found.sun_deg)
    middle = 0.5 * (edges[1:] + edges[:-1])
    rows = _binned(found.rate_deg_s, edges, attitude)
    values = {
        p: np.array([np.nan if row[f"p{p:02d}"] is None else row[f"p{p:02d}"] for row in rows]) for p in PERCENTILES
    }
    left.fill_between(middle, values[5], values[95], color="#b9dcf2", linewidth=0, label="5 to 95 %")
    left.plot(middle, values[50], color=NOISE, linewidth=1.4, label="half of them")
    assumed = found.attitude_assumed_deg
    if (assumed > 0.0).any():
        half = _binned(found.rate_deg_s, edges, assumed)
        left.plot(middle, [row["p50"] for row in half], color=ASSUMED, linewidth=1.2, label="of what is assumed, half")
    left.set_yscale("log")
    for axis in (left.yaxis.set_major_formatter, left.yaxis.set_minor_formatter):
        axis(PLAIN)
    left.legend(fontsize=8, framealpha=0.85, edgecolor="none")
    dress(left, x_label="spin, deg/s", y_label="deg RMS")
    head(left, "1-sigma of the attitude")
    # What light there is tells apart where spin does not.
    lit = float(np.ptp(found.lit)) > 0.05
    by, label = (found.lit, "share of the arc in sunlight") if lit else (found.rate_deg_s, "spin, deg/s")
    edges = _edges(by)
    grid = np.full((len(suns) - 1, len(edges) - 1), np.nan)
    column, row = _bin(by, edges), _bin(found.sun_deg, suns)
    for i in range(grid.shape[0]):
        for j in range(grid.shape[1]):
            own = attitude[(row == i) & (column == j)]
            if len(own) >= LEAST_IN_BIN:
                grid[i, j] = np.median(own)
    shown = np.log10(np.where(np.isfinite(grid), grid, np.nan))
    if np.isfinite(shown).any():
        mesh = right.pcolormesh(edges, suns, np.ma.masked_invalid(shown), cmap="Blues")
        bar = figure.colorbar(mesh, ax=right, format=lambda x, _: f"{10.0**x:.3g}")
        bar.ax.tick_params(labelsize=8)
    dress(right, x_label=label, y_label="Sun above the orbit's plane, deg")
    head(right, "the same, half of them: deg RMS")
    return figure


def _edges(values: np.ndarray) -> np.ndarray:
    low, high = float(values.min()), float(values.max())
    margin = 0.5 if high - low < 1e-9 else 0.0
    return np.linspace(low - margin, high + margin, BINS + 1)


def _bin(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)


def _percentiles(values: np.ndarray) -> dict[str, float | None]:
    """Of values that may be infinite: what nothing tells is worse than any number."""
    found = np.percentile(values, PERCENTILES, method="higher")
    return {f"p{p:02d}": float(x) if np.isfinite(x) else None for p, x in zip(PERCENTILES, found, strict=True)}


def _binned(by: np.ndarray, edges: np.ndarray, values: np.ndarray) -> list[dict[str, Any]]:
    number, rows = _bin(by, edges), []
    for k in range(len(edges) - 1):
        own = values[number == k]
        told = _percentiles(own) if len(own) >= LEAST_IN_BIN else dict.fromkeys([f"p{p:02d}" for p in PERCENTILES])
        rows.append({"from": float(edges[k]), "to": float(edges[k + 1]), "count": len(own), **told})
    return rows
