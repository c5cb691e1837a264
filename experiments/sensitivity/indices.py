"""Are Sobol indices from random cases right, and as uncertain as they say? Two functions whose indices are known.

Ishigami's function (a = 7, b = 0.1; with two inputs more that do nothing) and the g-function of eight inputs
(a = 0, 1, 4.5, 9, 99, 99, 99, 99), at several numbers of cases, each from many seeds: how far off, how far off they say
they are, and how often the 95 % interval holds the truth. Beside it the same neighbours without polynomials, and
`scipy.stats.sobol_indices`, which may call the function where it wants, with as many calls. Prints tables, writes JSON.

    .venv/bin/python experiments/sensitivity/indices.py --seeds 100 --out out/sobol.json
"""

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.stats import sobol_indices as scipy_indices
from scipy.stats import uniform

from fitting.sensitivity.sweeps import sobol_indices
from fitting.sensitivity.sweeps.matching import closed_index
from fitting.sensitivity.sweeps.polynomials import FOLDS, PolynomialModel, quantiles

CASES = (500, 2000, 5000)
A = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])


def ishigami(x: np.ndarray) -> np.ndarray:
    """Of inputs [inputs points] that are uniform over -pi to pi."""
    return np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])


def ishigami_truth() -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices."""
    first = np.array([0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 49.0 / 8.0, 0.0, 0.0, 0.0])
    joint = 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0) * np.array([1.0, 0.0, 1.0, 0.0, 0.0])
    variance = first.sum() + joint[0]
    return first / variance, (first + joint) / variance


def g_function(x: np.ndarray) -> np.ndarray:
    """Of inputs [inputs points] that are uniform over 0 to 1."""
    return np.prod((np.abs(4.0 * x - 2.0) + A[:, None]) / (1.0 + A[:, None]), axis=0)


def g_truth() -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices."""
    own = 1.0 / (3.0 * (1.0 + A) ** 2)
    variance = np.prod(1.0 + own) - 1.0
    return own / variance, own * np.prod(1.0 + own) / (1.0 + own) / variance


FUNCTIONS = {
    "Ishigami": (ishigami, ishigami_truth(), (-np.pi, np.pi)),
    "g": (g_function, g_truth(), (0.0, 1.0)),
}


def plain_totals(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Total indices by neighbours alone."""
    u, nothing = quantiles(x.T), np.zeros(len(y))
    none = PolynomialModel((), np.zeros(len(y), int), np.zeros((FOLDS, 1)), nothing)
    columns = list(range(len(x)))
    rest = ([column for column in columns if column != k] for k in columns)
    z = (y - y.mean()) / y.std()
    return np.array([1.0 - closed_index(u, z, others, none, np.ones(len(x))).value for others in rest])


def study(name: str, cases: int, seeds: int) -> dict:
    """All seeds of one function and one number of cases."""
    function, truth, (low, high) = FUNCTIONS[name]
    inputs = len(truth[0])
    ours, plain, scipy = [], [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        x = rng.uniform(low, high, (inputs, cases))
        y = function(x)
        found = sobol_indices({f"x{k + 1}": x[k] for k in range(inputs)}, y).inputs.values()
        ours.append([[[e.value, e.low, e.high] for e in (one.first, one.total)] for one in found])
        plain.append(plain_totals(x, y))
        # It takes n (inputs + 2) calls, n a power of two: the next one below.
        n = 2 ** int(np.log2(cases / (inputs + 2)))
        designed = scipy_indices(func=function, n=n, dists=[uniform(low, high - low)] * inputs, rng=rng)
        scipy.append([designed.first_order, designed.total_order])
    ours, plain, scipy = np.array(ours), np.array(plain), np.array(scipy)
    rows = {}
    for place, kind in enumerate(("first", "total")):
        value, below, above = np.moveaxis(ours[:, :, place], -1, 0)
        exact = truth[place]
        rows[kind] = {
            "truth": exact.tolist(),
            "mean": value.mean(axis=0).tolist(),
            "rms_error": np.sqrt(np.mean((value - exact) ** 2, axis=0)).tolist(),
            "half_interval": (0.5 * (above - below)).mean(axis=0).tolist(),
            "inside": np.mean((below <= exact) & (exact <= above), axis=0).tolist(),
            "scipy_rms_error": np.sqrt(np.mean((scipy[:, place] - exact) ** 2, axis=0)).tolist(),
        }
    rows["total"]["neighbours_alone_mean"] = plain.mean(axis=0).tolist()
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--cases", type=int, nargs="+", default=CASES)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    found = {name: {str(cases): study(name, cases, args.seeds) for cases in args.cases} for name in FUNCTIONS}
    for name, by_cases in found.items():
        for cases, kinds in by_cases.items():
            for kind, rows in kinds.items():
                print(f"\n{name}, {cases} cases, {kind}: inside 95 % intervals {np.mean(rows['inside']):.1%}")
                for key, values in rows.items():
                    print(f"  {key:22s}", " ".join(f"{value:7.3f}" for value in values))
    if args.out:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(json.dumps({"seeds": args.seeds, "functions": found}, indent=1) + "\n")


if __name__ == "__main__":
    main()
