"""The model problem of Penkov et al. 2009: the k that makes I(k) = int_1^100 (sin t - sin kt)^2 dt least, from any k0.

The answer is k = 1. Between side minima, at 0.92277 and 1.07684 the nearest, a local method finds it only from within
about +-0.045; with the interval's end growing by the rule of `fitting.starts.growing` it is found from everywhere.

    .venv/bin/python experiments/model_problem.py --out model-problem
"""

import argparse
import json
from functools import cache
from pathlib import Path

import numpy as np

from fitting.solvers.least_squares import FIRST_DAMPING, GROW, SHRINK
from fitting.starts.growing import ARC_ITERATIONS, FIRST_ARC, arc_ends

BEGIN, END = 1.0, 100.0
FIRST_END = 1.6
"""End of the first interval: anything from 1.3 to 1.9 does. Up to 3.0 no side minimum lies within the range of the
starts, but the flat ends of I make the longest steps leap out of it."""
LOWEST, HIGHEST, COUNT = 0.3, 3.0, 541
"""Range and number of the starts k0."""
NODES = 300
"""Gauss-Legendre nodes: exact to rounding for products of sines up to sin 3t over the whole interval."""
CONVERGED = 1e-6
ITERATIONS = 60
"""Of the methods that work on the whole interval."""


def sums(k: np.ndarray, end: float) -> tuple[np.ndarray, ...]:
    """I, its gradient, its Gauss-Newton and its exact second derivative at each k [starts], interval from 1 to `end`.

    With r = sin kt - sin t and r' = t cos kt:  I = int r^2,  I' = 2 int r r',  I'' = 2 int (r'^2 - r t^2 sin kt).
    """
    node, weight = _quadrature()
    t = BEGIN + 0.5 * (end - BEGIN) * (node + 1.0)
    weight = 0.5 * (end - BEGIN) * weight
    phase = np.multiply.outer(k, t)
    r, slope = np.sin(phase) - np.sin(t), t * np.cos(phase)
    gauss_newton = 2.0 * slope**2 @ weight
    return (
        r**2 @ weight,
        2.0 * (r * slope) @ weight,
        gauss_newton,
        gauss_newton - 2.0 * (r * t**2 * np.sin(phase)) @ weight,
    )


@cache
def _quadrature() -> tuple[np.ndarray, np.ndarray]:
    return np.polynomial.legendre.leggauss(NODES)


def levenberg_marquardt(k: np.ndarray, end: float, iterations: int) -> np.ndarray:
    """Where each start ends, with the damping of `fitting.solvers.least_squares`."""
    damping = np.full(k.shape, FIRST_DAMPING)
    cost, gradient, curvature, _ = sums(k, end)
    for _ in range(iterations):
        trial = k - gradient / (curvature * (1.0 + damping))
        new = sums(trial, end)
        better = new[0] < cost
        damping = np.where(better, damping * SHRINK, np.minimum(damping * GROW, 1e8))
        k, cost, gradient, curvature = (
            np.where(better, b, a) for a, b in zip((k, cost, gradient, curvature), (trial, *new[:3]), strict=True)
        )
    return k


def newton(k: np.ndarray, end: float, iterations: int) -> np.ndarray:
    """Where plain Newton steps on I lead each start; to maxima too, and anywhere."""
    for _ in range(iterations):
        _, gradient, _, second = sums(k, end)
        k = k - gradient / second
    return k


def growing_arcs(k: np.ndarray) -> tuple[np.ndarray, list[float]]:
    """Where each start ends when the interval grows, and the ends of the intervals.

    The interval is given to the schedule as samples so close that its first arc ends at `FIRST_END`.
    """
    spacing = (FIRST_END - BEGIN) / (FIRST_ARC - 1)
    times = np.linspace(BEGIN, END, round((END - BEGIN) / spacing) + 1)
    ends = []
    for sample in arc_ends(np.arange(len(times)), len(times) - 1):
        ends.append(float(times[sample]))
        k = levenberg_marquardt(k, ends[-1], ARC_ITERATIONS)
    return k, ends


def side_minima(lowest: float, highest: float) -> np.ndarray:
    """Minima of I over the whole interval but k = 1, each polished by Newton."""
    k = np.linspace(lowest, highest, 20001)
    cost = sums(k, END)[0]
    inner = k[1:-1][(cost[1:-1] < cost[:-2]) & (cost[1:-1] < cost[2:])]
    found = newton(inner, END, 6)
    return found[np.abs(found - 1.0) > CONVERGED]


def picture(k0: np.ndarray, ended: dict[str, np.ndarray], path: Path) -> None:
    """I(k) over the first, a middle and the whole interval, and below it where each start ends."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 8), layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True)
    k = np.linspace(LOWEST, HIGHEST, 4001)
    for end, color in ((END, "tab:blue"), (10.0, "tab:orange"), (FIRST_END, "tab:green")):
        above.plot(k, sums(k, end)[0] / (end - BEGIN), color=color, lw=1.0, label=f"1 ... {end:g}")
    above.set_ylabel("I(k) over the interval's length")
    above.legend(title="interval of t")
    above.set_title("Model problem: mean of (sin t - sin kt)² and where each start k0 ends")
    for (name, k), mark in zip(ended.items(), ("o", ".", "x"), strict=True):
        below.plot(k0, np.where((k > 0.0) & (k < 4.0), k, np.nan), mark, ms=3.5, label=name)
    below.set_xlabel("k, k0")
    below.set_ylabel("k at the end")
    below.set_ylim(0.0, 3.5)
    below.legend(loc="upper left")
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("model-problem"), help="directory for results")
    arguments = parser.parse_args()
    k0 = np.linspace(LOWEST, HIGHEST, COUNT)
    grown, ends = growing_arcs(k0)
    ended = {
        "growing arcs": grown,
        "Levenberg-Marquardt, whole interval": levenberg_marquardt(k0, END, ITERATIONS),
        "Newton, whole interval": newton(k0, END, ITERATIONS),
    }
    minima = side_minima(0.9, 1.1)
    from_paper = float(levenberg_marquardt(np.array([1.05]), END, ITERATIONS)[0])
    result = {
        "starts": COUNT,
        "range": [LOWEST, HIGHEST],
        "interval_ends": ends,
        "side_minima_near_1": minima.tolist(),
        "levenberg_marquardt_from_1.05": from_paper,
        "growing_arcs_from_1.05": float(growing_arcs(np.array([1.05]))[0][0]),
        "reached_1": {name: int(np.sum(np.abs(k - 1.0) < CONVERGED)) for name, k in ended.items()},
        "growing_arcs_worst_error": float(np.abs(grown - 1.0).max()),
    }
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "model_problem.json").write_text(json.dumps(result, indent=1))
    picture(k0, ended, arguments.out / "model_problem.png")
    print("nearest side minima:", ", ".join(f"{k:.5f}" for k in minima))
    print(f"from k0 = 1.05: {from_paper:.5f} over the whole interval, {result['growing_arcs_from_1.05']:.9f} growing")
    print("intervals end at", ", ".join(f"{end:.1f}" for end in ends))
    for name, count in result["reached_1"].items():
        print(f"{name:38s} {count:4d} of {COUNT} starts reach k = 1")


if __name__ == "__main__":
    main()
