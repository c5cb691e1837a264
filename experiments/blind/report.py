"""Table and picture of a blind study."""

from pathlib import Path
from typing import Any

import numpy as np
from generate import REGIMES

INSIDE_95 = 1.96
SHOWN = 6.0
"""Errors beyond so many sigmas are drawn there."""


def errors(rows: list[dict[str, Any]], prefix: str = "") -> np.ndarray:
    """Errors over sigma of the sessions that reached the truth, of names that start with `prefix`."""
    found = [row["over_sigma"] for row in rows if row["reached"] and "over_sigma" in row]
    values = [error for each in found for name, error in each.items() if name.startswith(prefix)]
    return np.array([value for value in values if np.isfinite(value)])


def _cells(name: str, rows: list[dict[str, Any]]) -> list[str]:
    reached = [row for row in rows if row["reached"]]
    missed = [row for row in rows if not row["reached"]]
    flagged = [row for row in missed if row["status"] != "converged"]
    alarms = [row for row in reached if row["status"] != "converged"]
    attitude, every = errors(rows, "attitude"), errors(rows)
    medians = [row["attitude_median_deg"] for row in reached]
    cells = [name, str(len(rows)), f"{100 * len(reached) / len(rows):.1f} %", str(len(flagged))]
    cells += [str(len(missed) - len(flagged)), str(len(alarms))]
    if not len(every):
        return [*cells, *[""] * 5]
    cells += [f"{np.median(medians):.2f}", f"{np.sqrt(np.mean(attitude**2)):.2f}", f"{np.sqrt(np.mean(every**2)):.2f}"]
    cells.append(f"{100 * np.mean(np.abs(every) < INSIDE_95):.1f} %")
    return [*cells, f"{np.median([row['seconds'] for row in rows]):.1f}"]


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: one line a regime and their sum, then one a kind of parameter."""
    heading = ["regime", "sessions", "reached", "missed, flagged", "missed, unflagged", "reached, flagged"]
    heading += ["attitude error, deg", "RMS attitude/sigma", "RMS all/sigma", "inside 95 %", "median time, s"]
    lines = [heading, ["---"] * len(heading)]
    for regime in REGIMES:
        of_regime = [row for row in rows if row["regime"] == regime]
        if of_regime:
            lines.append(_cells(regime, of_regime))
    lines.append(_cells("all", rows))
    kinds = [["kind", "errors", "RMS over sigma", "median |error|/sigma (normal: 0.67)", "inside 95 %"], ["---"] * 5]
    for kind in ("attitude", "magnet", "rods", "inertia", "imax", "gains", "albedo.specular", "albedo.diffuse"):
        z = errors(rows, kind)
        if len(z):
            share = f"{100 * np.mean(np.abs(z) < INSIDE_95):.1f} %"
            kinds.append([kind, str(len(z)), f"{np.sqrt(np.mean(z**2)):.2f}", f"{np.median(np.abs(z)):.2f}", share])
    return (
        "\n".join("| " + " | ".join(cells) + " |" for cells in lines)
        + "\n\n"
        + "\n".join("| " + " | ".join(cells) + " |" for cells in kinds)
    )


def picture(rows: list[dict[str, Any]], path: Path) -> None:
    """Errors over sigma of every fitted number beside the normal density, and who was found over the spin rate."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.5), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    z = np.clip(errors(rows), -SHOWN, SHOWN)
    bins = np.linspace(-SHOWN, SHOWN, 49)
    left.hist(z, bins=list(bins), density=True, color="tab:blue", alpha=0.7, label=f"{len(z)} errors")
    normal = np.exp(-0.5 * bins**2) / np.sqrt(2.0 * np.pi)
    left.plot(bins, normal, color="tab:red", label="unit normal")
    left.set_xlabel("(fitted - truth) / stated sigma")
    left.set_ylabel("density")
    left.set_title("Attitude at the first lit sample and all parameters")
    left.legend()
    for colour, regime in zip(("tab:blue", "tab:orange", "tab:green"), REGIMES, strict=True):
        for reached, marker in ((True, "o"), (False, "x")):
            chosen = [row for row in rows if row["regime"] == regime and row["reached"] == reached and "chi2" in row]
            if not chosen:
                continue
            label = f"{regime}: {len(chosen)} {'reached' if reached else 'missed'}"
            spin = [row["spin_deg_s"] for row in chosen]
            error = [row["attitude_median_deg"] for row in chosen]
            right.semilogy(spin, error, marker, color=colour, ms=5, label=label)
    right.set_xlabel("fastest rate in the session, deg/s")
    right.set_ylabel("median attitude error, deg")
    right.set_title("Synthetic Munin sessions fitted blind")
    right.legend(fontsize=8)
    figure.savefig(path, dpi=110)
