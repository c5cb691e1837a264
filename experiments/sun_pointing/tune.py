"""Gains of Sun pointing tuned by derivatives of means over 1000 cases, and what that gained on 1000 others.

The goal is the mean of settling time [s] + `PRICE` x impulse [N s]: what a newton second is worth in seconds; a case
that does not settle counts as the simulated time. Descent along the derivative by the logarithms of four knobs, in
steps of at most 15 %.

    .venv/bin/python experiments/sun_pointing/tune.py --steps 12 --out out/sun-tune.json
"""

import argparse
import json
from pathlib import Path

import numpy as np
from rich.progress import track

from fitting.sensitivity.means import slopes_of_means
from fitting.sensitivity.means.runs import run_all
from jaxsat.numerics import set_up_jax
from jaxsat.sweep.scenarios.sun_pointing import make

NAMES = ("attitude_gain", "rate_gain", "slew_rate", "search_rate")
METRICS = ("settling_time_s", "impulse_N_s")
PRICE = 3.0
STEP = 0.15
TIME_S = 1200.0
OTHERS = 1
"""Seed of the cases that are not tuned on; that of the others is 0."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--out", type=Path, default=Path("sun-tune.json"))
    arguments = parser.parse_args()
    set_up_jax()
    scenario = make({"time_s": f"{TIME_S:g}"})
    knobs = {knob.name: knob for knob in scenario.knobs}
    places = [list(knobs).index(name) for name in NAMES]

    def means(log_factor: np.ndarray) -> dict[str, float]:
        """On the other cases, as they are with these factors."""
        moved = np.zeros((arguments.cases, len(knobs)))
        moved[:, places] = log_factor
        (found,) = run_all(scenario, OTHERS, [moved])
        settled = np.isfinite(found["settling_time_s"])
        time_s = np.where(settled, found["settling_time_s"], TIME_S)
        goal = time_s + PRICE * found["impulse_N_s"]
        values = (goal.mean(), time_s.mean(), found["impulse_N_s"].mean(), settled.mean())
        return dict(zip(("goal_s", "settling_time_s", "impulse_N_s", "settled"), map(float, values), strict=True))

    log_factor, history = np.zeros(len(NAMES)), []
    best = (np.inf, log_factor)
    for number in track(range(arguments.steps), "steps"):
        at: dict[str, float] = dict(zip(NAMES, log_factor.tolist(), strict=True))
        found = slopes_of_means(scenario, NAMES, METRICS, cases=arguments.cases, at=at).metrics
        time_s, impulse = (found[name].slopes for name in METRICS)
        slope, goal = time_s.slopes + PRICE * impulse.slopes, time_s.mean + PRICE * impulse.mean
        history.append({"log_factor": log_factor.tolist(), "mean_goal_s": goal, "gradient": slope.tolist()})
        best = min(best, (goal, log_factor), key=lambda each: each[0])
        # The steps shrink, so that the noise of the derivatives averages out.
        log_factor = log_factor - STEP / (1.0 + 0.2 * number) * slope / np.abs(slope).max()
    result = {
        "parameters": {
            name: {
                "unit": knobs[name].unit,
                "before": knobs[name].value,
                "after": knobs[name].value * float(np.exp(by)),
            }
            for name, by in zip(NAMES, best[1], strict=True)
        },
        "others_before": means(np.zeros(len(NAMES))),
        "others_after": means(best[1]),
        "history": history,
    }
    for name, value in result["parameters"].items():
        print(f"{name:15s} {value['before']:.4g} -> {value['after']:.4g} {value['unit']}")
    for name, before in result["others_before"].items():
        print(f"{name:15s} {before:.4g} -> {result['others_after'][name]:.4g}   (cases that were not tuned on)")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
