"""The picture of the manifold study: how much is told, agreement, prediction, attitude, intervals, over samples."""

from typing import Any

import numpy as np
from matplotlib.ticker import FuncFormatter, NullFormatter

from experiments.sensitivity.manifold_rule import rms
from jaxsat.plotting.style import FAINT, INK, MAIN, dress, head, new_figure, png_bytes

COLOURS = (MAIN, "#2f8f6b", "#c0392b", "#8e5aa8")
GREY = "#8a8f99"


def picture(found: dict[str, Any]) -> bytes:
    """PNG content."""
    subtitle = "Munin's panel currents, 2 mA, 64 s: fits from the truth, by samples that are fitted"
    figure = new_figure(10.6, 6.6, "Where a fit tunes itself to its data", subtitle)
    axes = figure.subplots(
        2, 3, gridspec_kw={"left": 0.065, "right": 0.985, "top": 0.86, "bottom": 0.08, "wspace": 0.26, "hspace": 0.42}
    )
    fits = [f for f in found["fits"] if f["row"] == "longer arc"]
    sets = [name for name in found["sets"] if any(f["set"] == name for f in fits)]
    whole = max(sets[:3], key=sets.index)
    narrow = list(found["widths"])[0]
    for name, colour in zip(sets, COLOURS, strict=False):
        own = [f for f in fits if f["set"] == name and f["priors"] == narrow]
        counts, told = middle(own, "told")
        free = max(f["unknowns"] for f in own)
        axes[0, 0].plot(counts, told, "o-", color=colour, markersize=3.5, linewidth=1.1, label=f"{name}: {free} free")
        axes[0, 0].axhline(free, color=colour, linewidth=0.7, linestyle=(0, (2, 3)))
        _, sigma = middle(own, "attitude_sigma_deg")
        axes[1, 0].plot(counts, sigma, "-", color=colour, linewidth=1.1, label=name)
        off = [rms([f["attitude_deg"] for f in own if f["samples"] == count]) for count in counts]
        axes[1, 0].plot(counts, off, "o", color=colour, markersize=3.5)
    for number, width in enumerate(found["widths"]):
        own, line = [f for f in fits if f["set"] == whole and f["priors"] == width], ("-", "--")[number]
        counts = sorted({f["samples"] for f in own})
        of = [[f for f in own if f["samples"] == count] for count in counts]
        inside = [np.sqrt(np.median([f["square"] / max(f["readings"] - f["told"], 1.0) for f in each])) for each in of]
        missed = [np.hypot(1.0, np.median([f["missed"] for f in each])) for each in of]
        promised = [np.hypot(1.0, np.median([f["ahead"] for f in each])) for each in of]
        axes[0, 1].loglog(counts, inside, line, marker="s", color=GREY, markersize=3, linewidth=1.1,
                          label=f"fitted, {width}")  # fmt: skip
        axes[0, 1].loglog(counts, missed, "o", color=COLOURS[2 - number], markersize=3.5)
        axes[0, 1].loglog(counts, promised, line, color=COLOURS[2 - number], linewidth=1.1, label=f"next, {width}")
    axes[0, 0].set_xscale("log")
    axes[0, 0].set_ylim(0.0, 55.0)
    axes[1, 0].set_xscale("log")
    axes[1, 0].set_yscale("log")
    axes[1, 0].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes[1, 0].yaxis.set_minor_formatter(NullFormatter())
    axes[0, 1].axhline(np.sqrt(2.0), color=INK, linewidth=0.7, linestyle=(0, (4, 3)))
    ahead, missed = (np.array([f[key] for f in fits]) for key in ("ahead", "missed"))
    narrowly = np.array([f["priors"] == narrow for f in fits])
    for which, colour, text in ((narrowly, COLOURS[0], narrow), (~narrowly, COLOURS[1], "next to none")):
        if which.any():
            axes[0, 2].loglog(ahead[which], missed[which], ".", color=colour, markersize=3, label=text, alpha=0.6)
    ends = np.array([ahead.min(), ahead.max()])
    axes[0, 2].loglog(ends, ends, color=INK, linewidth=0.8)
    ratio = np.array([f["attitude_deg"] / f["attitude_sigma_deg"] for f in fits])
    agreement = np.array([np.sqrt(f["square"] / max(f["readings"] - f["told"], 1.0)) for f in fits])
    axes[1, 1].plot(agreement[narrowly], ratio[narrowly], ".", color=COLOURS[0], markersize=3, alpha=0.6)
    axes[1, 1].set_xlim(0.0, 2.0)
    axes[1, 1].set_ylim(0.0, 2.5)
    shown = [p for p in found["profiles"] if p.get("sigma")]
    names = list(dict.fromkeys(p["name"] for p in shown))
    for name, colour in zip(names, COLOURS, strict=False):
        for width, mark in zip(found["widths"], ("o", "x"), strict=False):
            own = [p for p in shown if p["name"] == name and p["priors"] == width and p["lower"] is not None]
            own = [p for p in own if p["upper"] is not None]
            wide = [0.5 * (p["upper"] - p["lower"]) / p["sigma"] for p in own]
            label = f"{name}, {width}" if own else None
            axes[1, 2].semilogx([p["samples"] for p in own], wide, mark, color=colour, markersize=4, label=label)
    axes[1, 2].axhline(1.0, color=FAINT, linewidth=0.8)
    for axis in (axes[0, 0], axes[0, 1], axes[0, 2], axes[1, 0], axes[1, 2]):
        if axis.get_legend_handles_labels()[0]:
            axis.legend(fontsize=6.5, framealpha=0.85, edgecolor="none")
    texts = (
        ("Numbers that data tell; dotted: free", "samples", ""),
        ("RMS over noise; lines: promised", "samples", ""),
        ("Own error in the next ten samples", "promised, over noise", "found"),
        ("Attitude, deg RMS; lines: sigma", "samples", ""),
        ("What agreement says of the error", "residual over noise, fitted", "attitude, off over its sigma"),
        ("Profile interval over quadratic one", "samples", ""),
    )
    for axis, (title, x_label, y_label) in zip(axes.flat, texts, strict=True):
        dress(axis, x_label=x_label, y_label=y_label)
        head(axis, title)
    return png_bytes(figure)


def middle(fits: list[dict], key: str) -> tuple[list[int], list[float]]:
    """Samples, and the median of a figure at each."""
    counts = sorted({f["samples"] for f in fits})
    return counts, [float(np.median([f[key] for f in fits if f["samples"] == count])) for count in counts]
