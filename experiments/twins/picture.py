"""Picture of a study of twins: error of the attitude beside its sigma, all z beside the normal law, z by parameter."""

from pathlib import Path
from typing import Any

import numpy as np

from experiments.twins.score import REACHED_DEG, summary

COLOURS = {"converged": "tab:blue", "ambiguous": "tab:orange", "not_converged": "tab:gray"}


def picture(kind: str, rows: list[dict[str, Any]], file: Path) -> None:
    """Writes the PNG of the rows of one kind."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    found = summary(rows)
    figure, (scatter, normal, each) = plt.subplots(1, 3, figsize=(15, 4.5), layout="constrained")
    for status, colour in COLOURS.items():
        chosen = [row for row in rows if row["status"] == status and "sigma_deg" in row]
        label = f"{status}: {len(chosen)}"
        points = [(row["sigma_deg"], row["attitude_deg"]) for row in chosen]
        scatter.scatter(*np.reshape(points, (-1, 2)).T, s=14, color=colour, label=label)
    scatter.axline((0.1, 0.1), (1.0, 1.0), color="black", linewidth=0.8)
    scatter.axhline(REACHED_DEG, color="tab:red", linewidth=0.8, linestyle="--")
    scatter.set(xscale="log", yscale="log", xlabel="promised sigma of the attitude, deg", ylabel="RMS error, deg")
    scatter.legend(fontsize=8)
    scatter.set_title(f"{kind}: {found['reached']} of {found['sessions']} at the truth, {found['silent']} silent")

    z = [value for row in rows if row.get("reached") for value in row["z"].values()]
    edges = np.linspace(-5.0, 5.0, 51)
    normal.hist(np.clip(z, -4.99, 4.99), edges, color="tab:blue", alpha=0.6)
    expected = len(z) * (edges[1] - edges[0]) / np.sqrt(2.0 * np.pi)
    normal.plot(edges, expected * np.exp(-0.5 * edges**2), color="black")
    normal.set(xlabel="(value - truth) / sigma", title=f"{len(z)} numbers, RMS {found['z_rms'] or float('nan'):.2f}")

    names = list(found["z_rms_of"])
    each.barh(names, list(found["z_rms_of"].values()), color="tab:blue")
    each.axvspan(0.9, 1.15, color="tab:green", alpha=0.2)
    each.tick_params(axis="y", labelsize=5 if len(names) > 25 else 8)
    each.set(xlabel="RMS of z", title="by parameter")
    figure.savefig(file, dpi=110)
    plt.close(figure)
