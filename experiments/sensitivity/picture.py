"""The picture of the study of refits: scatter over predicted sigma, and by what biases of first order are off."""

from typing import Any

import numpy as np

from jaxsat.plotting.style import FAINT, INK, MAIN, dress, head, new_figure, png_bytes

COLOURS = {"noise": MAIN, "noise and what is assumed": "#c0392b"}


def picture(found: dict[str, Any]) -> bytes:
    """PNG content."""
    subtitle = f"{found['refits']} refits each of simulated sessions of a small satellite"
    figure = new_figure(8.6, 5.0, "Predicted and found", subtitle)
    left, right = figure.subplots(
        1, 2, gridspec_kw={"left": 0.17, "right": 0.975, "top": 0.84, "bottom": 0.12, "wspace": 0.28}
    )
    error = 1.0 / np.sqrt(2.0 * found["refits"])
    left.axvspan(0.9, 1.1, color="#e7e9ee", linewidth=0)
    left.axvline(1.0, color=FAINT, linewidth=0.8)
    names: list[str] = []
    for number, kind in enumerate(COLOURS):
        each = found["scatter"][kind]
        rows = {"attitude": each["attitude"], **each["numbers"]}
        names = list(rows)
        place = np.arange(len(rows)) + 0.24 * (number - 0.5)
        ratio = [row["ratio"] for row in rows.values()]
        left.errorbar(ratio, place, xerr=error, fmt="o", markersize=3.5, color=COLOURS[kind], label=kind, linewidth=0.9)
    left.set_yticks(range(len(names)), names)
    left.set_ylim(len(names) - 0.4, -0.6)
    left.legend(fontsize=7.5, loc="lower left", framealpha=0.85, edgecolor="none")
    dress(left, x_label="scatter of refits over predicted sigma")
    head(left, "Sigma; grey: 10 %")
    for name, rows in found["bias"].items():
        right.loglog([row["in_sigmas"] for row in rows], [100.0 * row["off"] for row in rows], "o-", markersize=3.5,
                     linewidth=1.0, label=name)  # fmt: skip
    right.axhline(15.0, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
    right.legend(fontsize=7.5, framealpha=0.85, edgecolor="none")
    dress(right, x_label="bias of a refit, in sigmas of noise", y_label="%")
    head(right, "First-order bias: by what it is off")
    return png_bytes(figure)
