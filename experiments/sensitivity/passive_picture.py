"""The picture of the study of passive satellites: descent, dispersed cases, and how exact derivatives grow."""

from typing import Any

import numpy as np

from jaxsat.plotting.style import FAINT, INK, MAIN, dress, head, new_figure, png_bytes

COLOURS = ("#9aa3b2", MAIN, "#c0392b")


def picture(found: dict[str, Any], angles: dict[str, np.ndarray]) -> bytes:
    """PNG content; `angles` are the RMS angles [cases, orbits] of each design [deg]."""
    cases = len(next(iter(angles.values())))
    figure = new_figure(8.6, 6.2, "Magnet and rods of a 3U by slopes of its mean wobble", f"{cases} cases that tumble")
    grid = {"left": 0.1, "right": 0.975, "top": 0.86, "bottom": 0.09, "wspace": 0.26, "hspace": 0.42}
    (way, share), (wander, growth) = figure.subplots(2, 2, gridspec_kw=grid)
    _way(way, found["way"])
    orbits = np.arange(1, next(iter(angles.values())).shape[1] + 1)
    for (name, each), colour in zip(angles.items(), COLOURS, strict=True):
        last = np.sqrt(np.mean(each[:, -4:] ** 2, axis=1))
        share.plot(np.sort(last), np.linspace(0.0, 100.0, len(last)), color=colour, label=name)
        wander.plot(orbits, np.median(each, axis=0), color=colour)
        wander.plot(orbits, np.percentile(each, 95, axis=0), color=colour, linewidth=0.8, linestyle=(0, (4, 3)))
    share.set_xscale("log")
    share.xaxis.set_major_formatter("{x:g}")
    share.legend(fontsize=8, frameon=False)
    dress(share, x_label="RMS angle to the field over the last four orbits, deg", y_label="% of cases")
    head(share, "What is left after 60 orbits")
    wander.set_yscale("log")
    wander.set_yticks([5, 10, 20, 40, 80])
    wander.yaxis.set_major_formatter("{x:g}")
    wander.yaxis.set_minor_formatter("")
    dress(wander, x_label="orbit", y_label="RMS angle over the orbit, deg")
    head(wander, "Median, and 95 % (broken)")
    for name, colour in (("tumbling", COLOURS[0]), ("captured", COLOURS[2])):
        sizes = found[name]["size_by_orbit"]
        growth.semilogy(np.arange(1, len(sizes) + 1), sizes, "o-", markersize=3, color=colour, label=name)
    growth.legend(fontsize=8, frameon=False)
    dress(growth, x_label="orbit", y_label="|d ln angle / d ln dipole|")
    head(growth, "Exact derivatives, median of 16")
    return png_bytes(figure)


def _way(axes: Any, way: list[dict[str, Any]]) -> None:
    rods = [np.mean(row["rods"]) for row in way]
    axes.loglog(rods, [row["dipole_A_m2"] for row in way], "o-", markersize=3.5, linewidth=0.9, color=INK)
    for row, place in ((way[0], (6, -12)), (way[-1], (-8, 8))):
        at = (np.mean(row["rods"]), row["dipole_A_m2"])
        axes.annotate(f"{row['cost_deg']:.0f}°", at, fontsize=8, xytext=place, textcoords="offset points", color=INK)
    axes.set_yticks([0.1, 0.2, 0.3])
    axes.set_xticks([3, 4, 5, 6, 8, 10])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")
    dress(axes, x_label="rods along an axis", y_label="dipole, A m²")
    axes.grid(color=FAINT, linewidth=0.3)
    head(axes, "The descent, and its cost")
