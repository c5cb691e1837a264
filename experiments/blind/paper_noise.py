"""The paper's programs with 2 mA of noise: are errors those of the noise, or is there a bias left?

For each program of Penkov et al. 2009 with a published result, draws of the noise over one motion (`paper_settings`)
are fitted without a first guess. Printed: mean and RMS error over draws, and both over the stated sigma, which is the
Cramer-Rao bound of the model; a bias would show as a mean error of many sigma / sqrt(draws).

    .venv/bin/python experiments/blind/paper_noise.py --draws 12 --out munin-paper-noise.json
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from paper_figures import fitted, measured, truth_of
from paper_settings import SETTINGS, Setting
from rich.progress import track

NOISE_MA = 2.0
"""That of the currents and, by default, that which a fit assumes."""
BODY = ("xx", "yy", "zz", "xy", "xz", "yz")


def true_values(setting: Setting, cfg: dict[str, Any]) -> dict[str, float]:
    """What the setting frees, in the units of fit.json."""
    tensor = np.array(cfg["inertia"])[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    all_values = {
        **dict(zip(("magnet.x", "magnet.y", "magnet.z"), cfg["magnet"], strict=True)),
        **dict(zip(("rods.y", "rods.z"), cfg["rods"], strict=True)),
        "imax": cfg["imax"],
        **{f"inertia.{name}": float(value) for name, value in zip(BODY, tensor, strict=True)},
    }
    kinds = {"alsI0": "magnet", "alsI23": "rods", "alsImax": "imax", "alsJ": "inertia"}
    return {name: value for name, value in all_values.items() if name.startswith(kinds[setting.free])}


def study(setting: Setting, draws: int) -> list[dict[str, Any]]:
    """A row for each free parameter; draws whose fit has not converged are counted and left in."""
    truth = truth_of(setting)
    true = true_values(setting, truth["cfg"])
    errors: dict[str, list[float]] = {name: [] for name in true}
    sigmas: dict[str, list[float]] = {name: [] for name in true}
    statuses = []
    for seed in track(range(draws), f"figures {setting.figures}, {setting.free}", transient=True):
        result = fitted(truth, measured(truth, setting, NOISE_MA, seed), setting, "ours")
        statuses.append(result.status)
        for p in result.parameters:
            if p.name in true and p.sigma:
                errors[p.name].append(p.value - true[p.name])
                sigmas[p.name].append(p.sigma)
    rows = []
    for name, found in errors.items():
        error, sigma = np.array(found), np.array(sigmas[name])
        rows.append(
            {
                "figures": setting.figures,
                "program": setting.free,
                "parameter": name,
                "truth": true[name],
                "draws": len(error),
                "converged": statuses.count("converged"),
                "bound": float(np.median(sigma)),
                "mean_error": float(error.mean()),
                "rms_error": float(np.sqrt((error**2).mean())),
                "rms_over_bound": float(np.sqrt(((error / sigma) ** 2).mean())),
                "mean_over_bound": float((error / sigma).mean()),
            }
        )
    return rows


def main() -> None:
    """Runs all programs, prints the table and writes the numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=12, help="draws of the noise for each program")
    parser.add_argument("--out", type=Path, default=Path("munin-paper-noise.json"))
    arguments = parser.parse_args()
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    chosen = [s for s in SETTINGS if s.figures in ("17, 18", "29", "20", "22", "27, 28")]
    print("| figures | program | parameter | truth | bound | mean error | RMS error | RMS / bound | mean / bound |")
    print("| --- " * 9 + "|")
    rows = []
    for setting in chosen:
        for row in study(setting, arguments.draws):
            rows.append(row)
            numbers = [f"{row[key]:.4g}" for key in ("truth", "bound", "mean_error", "rms_error")]
            ratios = [f"{row['rms_over_bound']:.2f}", f"{row['mean_over_bound']:+.2f}"]
            print(
                f"| {row['figures']} | {row['program']} | {row['parameter']} | " + " | ".join(numbers + ratios) + " |"
            )
    arguments.out.write_text(json.dumps({"schema": "jaxsat.paper-noise/1", "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
