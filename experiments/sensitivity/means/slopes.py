"""Slopes of means of closed loops in three ways: smoothed, exact, and by differences of the same cases.

Three sets of closed loops, each with one knob or two:

- pointing of the bundled 3U with perfect sensors, which has no steps but those of its settling time;
- the same with the sensors of its file: the magnetometer has digits, the filter takes or leaves readings;
- Sun pointing, whose modes and pulses switch (`jaxsat.sweep.scenarios.sun_pointing`).

Of each metric the slope of its mean with the knob moved by 5 % to both sides (`fitting.sensitivity.means`), the same
with moves that are normal, the mean of the exact derivatives of the cases, and the mean of their central differences
with a step of 1e-5, all from the same random numbers and each with its sampling error. Where cases are smooth all
agree, the last two to 1e-6; where they jump exact derivatives say nothing of the jumps, differences of a small step are
of any size, and the first two agree. Then how knobs are best moved, each alone or all at once, at an equal number of
runs. Prints tables, writes JSON and a picture.

    .venv/bin/python -m experiments.sensitivity.means.slopes --cases 200 --out sensitivity
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from experiments.sensitivity.means.picture import picture
from fitting.sensitivity.means import slopes_of_means
from fitting.sensitivity.means.pairs import WIDTH, mean_and_error
from fitting.sensitivity.means.runs import run_all
from jaxsat.numerics import set_up_jax
from jaxsat.sweep import Scenario
from jaxsat.sweep.scenarios import point, sun_pointing

STEP = 1e-5
LOOPS = {
    "pointing, perfect sensors": (point.make, {"orbits": "0.5", "sensors": "perfect"}, ("frequency", "damping")),
    "pointing, sensors of the file": (point.make, {"orbits": "0.5"}, ("frequency", "damping")),
    "Sun pointing": (sun_pointing.make, {"time_s": "900"}, ("slew_rate", "rate_dead_band")),
}
MANY = {
    "pointing, sensors of the file": ("frequency", "damping", "slew", "friction_known", "dipole", "rate_errors"),
    "Sun pointing": ("attitude_gain", "rate_gain", "slew_rate", "search_rate", "torque", "min_pulse"),
}
"""Knobs that are moved alone or at once."""


def differences(scenario: Scenario, knobs: tuple[str, ...], cases: int, step: float) -> dict[str, dict[str, Any]]:
    """Mean and error of central differences of the cases' own metrics, by metric and knob."""
    names = [knob.name for knob in scenario.knobs]
    found: dict[str, dict[str, Any]] = {name: {} for name in scenario.metrics}
    for knob in knobs:
        push = np.zeros((cases, len(names)))
        push[:, names.index(knob)] = step
        up, down = run_all(scenario, 0, [push, -push])
        for name in scenario.metrics:
            slope = (up[name] - down[name]) / (2.0 * step)
            found[name][knob] = mean_and_error(slope[np.isfinite(slope)])
    return found


def four_ways(scenario: Scenario, knobs: tuple[str, ...], cases: int) -> dict[str, Any]:
    """Slopes and errors of every metric by every knob, by the name of the way."""
    begin = time.perf_counter()
    means = slopes_of_means(scenario, knobs, tuple(scenario.metrics), cases=cases, exact=True)
    small = differences(scenario, knobs, cases, STEP)
    spread = {
        knob: slopes_of_means(scenario, (knob,), tuple(scenario.metrics), cases=cases, together=True).metrics
        for knob in knobs
    }
    found: dict[str, Any] = {"seconds": time.perf_counter() - begin, "ended": means.ended, "metrics": {}}
    for name, one in means.metrics.items():
        exact = one.exact
        assert exact is not None  # noqa: S101
        found["metrics"][name] = {
            knob: {
                "mean": one.mean,
                "smoothed": (float(one.slopes.slopes[k]), float(one.slopes.sigma[k])),
                "exact": (float(exact.slopes[k]), float(exact.sigma[k])),
                "apart": (float(exact.apart[k]), float(exact.apart_sigma[k])),
                "difference": small[name][knob],
                "normal": tuple(float(each[0]) for each in _first(spread[knob][name])),
            }
            for k, knob in enumerate(knobs)
        }
    return found


def _first(one):
    return one.slopes.slopes, one.slopes.sigma


def alone_or_at_once(scenario: Scenario, knobs: tuple[str, ...], cases: int) -> dict[str, dict[str, list[float]]]:
    """Errors of slopes by metric: each knob alone, and all at once with as many runs, so with more cases."""
    ways = {"alone": (cases, False), "at once": (cases * len(knobs), True)}
    found: dict[str, dict[str, list[float]]] = {name: {} for name in scenario.metrics}
    for way, (count, together) in ways.items():
        means = slopes_of_means(scenario, knobs, tuple(scenario.metrics), cases=count, together=together)
        for name, one in means.metrics.items():
            found[name][way] = one.slopes.sigma.tolist()
    return found


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("sensitivity"))
    asked = parser.parse_args()
    set_up_jax()
    found: dict[str, Any] = {"cases": asked.cases, "width": WIDTH, "step": STEP, "loops": {}, "alone or at once": {}}
    for title, (make, options, knobs) in LOOPS.items():
        scenario = make(options)
        own = found["loops"][title] = four_ways(scenario, knobs, asked.cases)
        print(f"\n{title}: {own['ended']}, {own['seconds']:.0f} s\n{'':42s}", end="")
        print("".join(f"{way:>22s}" for way in ("moved by 5 %", "normal moves", "exact", "difference 1e-5")))
        for name, by in own["metrics"].items():
            for knob, one in by.items():
                texts = (
                    f"{one[way][0]:.4g} ± {one[way][1]:.2g}" for way in ("smoothed", "normal", "exact", "difference")
                )
                print(f"{name + ' by ' + knob:42s}", "".join(f"{text:>22s}" for text in texts))
    for title, knobs in MANY.items():
        make, options, _ = LOOPS[title]
        errors = alone_or_at_once(make(options), knobs, max(asked.cases // 2, 16))
        found["alone or at once"][title] = {"knobs": knobs, "errors": errors}
        print(
            f"\n{title}: error at once over error alone, at equal numbers of runs\n{'':26s}",
            *(f"{k:>15s}" for k in knobs),
        )
        for name, own in errors.items():
            pairs = zip(own["at once"], own["alone"], strict=True)
            print(f"{name:26s}", *(f"{a / b:15.2f}" if b > 0.0 else f"{'-':>15s}" for a, b in pairs))
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "slopes.json").write_text(json.dumps(found, indent=1) + "\n")
    picture(found["loops"], asked.out / "slopes.png")


if __name__ == "__main__":
    main()
