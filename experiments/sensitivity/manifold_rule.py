"""The rule of the manifold study: what it says of each fit, a threshold that is tuned beside it, and how both fare."""

from typing import Any

import numpy as np
from scipy.stats import spearmanr

from fitting.sensitivity.told import PREDICTS

EXCEEDED = 0.05
"""Share of the fits called predicting that may be off by more than the noise."""
VERDICTS = ("told", "told with priors", "between", "tuned")


def judged(fits: list[dict]) -> dict[str, Any]:
    """The threshold that the sessions tuned on ask for, what the rule says of the others, and what came of them."""
    settled = [each for each in fits if each["settled"]]
    kinds = {kind: [each for each in settled if each["kind"] == kind] for kind in ("tuned on", "tried on")}
    threshold = threshold_of(kinds["tuned on"])
    below = [f["missed"] > 1.0 for f in kinds["tried on"] if f["ahead"] <= threshold]
    lines = [
        f"{len(fits) - len(settled)} of {len(fits)} fits did not settle and are left out",
        f"tuned: up to {threshold:.2f} of the noise told ahead, {100 * EXCEEDED:g} % of the fits are off by more "
        f"than the noise; of {len(below)} others up to it {100 * float(np.mean(below)) if below else 0.0:.1f} %",
    ]
    table, reach = {}, {}
    for kind, some in kinds.items():
        for verdict in VERDICTS:
            own = [f for f in some if verdict_of(f) == verdict]
            if own:
                row = table[f"{kind}: {verdict}"] = about(own)
                lines.append(f"{kind}, {verdict}: {told_of(row)}")
        for name, low, high in (("below 0.1", 0.0, 0.1), ("0.1 to 1", 0.1, 1.0), ("above 1", 1.0, np.inf)):
            own = [f for f in some if low <= f["holds_to"] < high]
            if own:
                row = reach[f"{kind}: {name}"] = about(own)
                lines.append(f"{kind}, linear to {name} sigma: {told_of(row)}")
        chi = [np.sqrt(f["square"] / max(f["readings"] - f["told"], 1.0)) for f in some]
        off = [f["attitude_deg"] / f["attitude_sigma_deg"] for f in some]
        table[f"{kind}: rank correlation"] = float(np.asarray(spearmanr(chi, off))[0])
        lines.append(f"{kind}: rank correlation of agreement with error {table[f'{kind}: rank correlation']:.3f}")
    return {"threshold": threshold, "table": table, "reach": reach, "lines": lines}


def threshold_of(fits: list[dict]) -> float:
    """The largest told error ahead, below one, up to which fits that are off by more than the noise are few enough."""
    order = sorted((f for f in fits if f["ahead"] < 1.0), key=lambda f: f["ahead"])
    if not order:
        return 0.5
    beyond = np.cumsum([f["missed"] > 1.0 for f in order]) / np.arange(1, len(order) + 1)
    good = np.flatnonzero(beyond <= EXCEEDED)
    return float(order[good[-1]]["ahead"]) if len(good) else 0.0


def verdict_of(fit: dict) -> str:
    """What a user can say without the truth.

    Tuned: the fit's own error in what comes next is told to be above the noise. Between: below it, yet not by enough.
    Told with priors: it predicts, half an unknown or more by what the priors say. Told: it predicts by its data.
    """
    if fit["ahead"] >= 1.0:
        return "tuned"
    if fit["ahead"] > PREDICTS:
        return "between"
    return "told" if fit["told"] > fit["unknowns"] - 0.5 else "told with priors"


def about(fits: list[dict]) -> dict[str, float]:
    """What became of some fits: medians, but for RMS of what is counted in sigmas."""
    square = np.array([f["square"] / max(f["readings"] - f["told"], 1.0) for f in fits])
    return {
        "fits": len(fits),
        "in_sample": float(np.sqrt(np.median(square))),
        "missed": float(np.median([f["missed"] for f in fits])),
        "ahead": float(np.median([f["ahead"] for f in fits])),
        "above_noise": float(np.mean([f["missed"] > 1.0 for f in fits])),
        "ratio": float(np.exp(np.median([np.log(max(f["missed"], 1e-9) / f["ahead"]) for f in fits]))),
        "attitude": rms([f["attitude_deg"] / f["attitude_sigma_deg"] for f in fits]),
        "numbers": rms([f["numbers_off"] for f in fits]),
        "walked": float(np.median([f["walked"] for f in fits])),
    }


def told_of(row: dict[str, float]) -> str:
    """One line."""
    return (
        f"{row['fits']} fits; fitted {row['in_sample']:.2f}; own error ahead {row['missed']:.2f}, told "
        f"{row['ahead']:.2f}, above the noise in {100 * row['above_noise']:.1f} %; attitude {row['attitude']:.2f} "
        f"sigma, numbers {row['numbers']:.2f} sigma"
    )


def rms(values: list[float]) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
