"""Are the sigmas and biases that `jaxsat sensitivity` predicts those of fits? Simulated sessions, fitted again.

Sessions of a small satellite with noise, and with numbers off that the fit does not free, drawn from their sigmas: the
scatter of what the solver finds is compared with the predicted sigmas. Then sessions without noise in which one number
is off by more and more: what the solver finds is compared with the bias of first order.

    .venv/bin/python -m experiments.sensitivity.refits --refits 500 --out sensitivity
"""

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

SATELLITE = Path(__file__).parent / "small.sat.toml"
PLAN = {"duration_s": 900.0, "every_s": 15.0, "rate_deg_s": (1.0, 0.3, -2.0), "quaternion": (0.8, 0.36, -0.48, 0.0)}
FREE = ["magnet", "mag.bias", "gyro.bias", "sun.gain"]
BLIND = [*FREE, "inertia", "rods"]
"""Their common scale with the magnet is told by the priors alone."""
ASSUMED = ["inertia.xx=2e-6", "inertia.yy=2e-6", "inertia.zz=2e-6", "mag.delay=0.05", "mag.turn=0.002"]
ERRORS = {
    "inertia.zz": "inertia off",
    "rods.0.moment": "rods off, at last by all of them",
    "mag.delay": "late stamps",
    "gyro.scale.x": "wrong scale",
    "albedo.diffuse": "albedo off",
    "mag.turn.z": "tilted magnetometer",
}
SIZES = {
    "inertia.zz": [1e-6, 3e-6, 1e-5, 3e-5, 1e-4],
    "rods.0.moment": [2e-5, 6e-5, 2e-4, 6e-4, 2e-3],
    "mag.delay": [0.03, 0.1, 0.3, 1.0, 3.0],
    "gyro.scale.x": [0.001, 0.003, 0.01, 0.03, 0.1],
    "albedo.diffuse": [0.001, 0.003, 0.01, 0.03, 0.1],
    "mag.turn.z": [0.001, 0.003, 0.01, 0.03, 0.1],
}
"""In the units of results."""


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--refits", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("sensitivity"))
    asked = parser.parse_args()
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from fitting.sensitivity.plan import vantage_of_plan
    from jaxsat.satellites import read_satellite
    from jaxsat.synthetic.twins import TwinSettings

    vantage = vantage_of_plan(read_satellite(SATELLITE), TwinSettings(**PLAN))
    began = time.perf_counter()
    scatter = {
        "noise": scattered(vantage, FREE, [], asked.refits, asked.seed),
        "noise and what is assumed": scattered(vantage, FREE, ASSUMED, asked.refits, asked.seed + 1),
        "not regular": scattered(vantage, BLIND, [], asked.refits, asked.seed + 2),
    }
    bias = {name: biased(vantage, name) for name in ERRORS}
    found = {"plan": PLAN, "free": FREE, "refits": asked.refits, "scatter": scatter, "bias": bias}
    found["seconds"] = time.perf_counter() - began
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "refits.json").write_text(json.dumps(found, indent=1))
    from experiments.sensitivity.picture import picture

    (asked.out / "refits.png").write_bytes(picture(found))
    for kind, each in scatter.items():
        ratios = np.array([row["ratio"] for row in each["numbers"].values()])
        word = "regular" if each["regular"] else "flagged"
        spread = f"{ratios.min():.3f} to {ratios.max():.3f}, RMS of all {np.sqrt((ratios**2).mean()):.3f}"
        print(f"{kind} ({word}): scatter over sigma {spread}; attitude {each['attitude']['ratio']:.3f}")
    for name, rows in bias.items():
        shown = ", ".join(f"{row['size']:g}: {100 * row['off']:.1f} %" for row in rows)
        print(f"{name} ({ERRORS[name]}): prediction off by {shown}")


def scattered(vantage, free: list[str], consider: list[str], refits: int, seed: int) -> dict:
    """Scatter of refits beside predicted sigmas."""
    from fitting.sensitivity.analysis import analysed

    predicted = analysed(vantage, free, consider)
    rng = np.random.default_rng(seed)
    draws = rng.normal(size=(refits, len(predicted.choice.considered)))
    noise = rng.normal(size=(refits, *vantage.slopes.residual.shape))

    def one(k):
        shifts = dict(zip(predicted.choice.considered, draws[k] * predicted.choice.sigma, strict=True))
        return refitted(vantage, predicted, shifts, noise[k])

    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(one, range(refits)))
    off, turns = (np.array([each[n] for each in results]) for n in (0, 1))
    scatter = np.sqrt((off**2).mean(axis=0))
    numbers = {
        row.name: {"predicted": row.sigma, "scatter": float(s), "ratio": float(s / row.sigma), "unit": row.unit}
        for row, s in zip(predicted.quoted.rows, scatter, strict=True)
    }
    rms, told = float(np.degrees(np.sqrt((turns**2).mean()))), predicted.attitude_rms_deg[2]
    attitude = {"predicted": told, "scatter": rms, "ratio": rms / told, "unit": "deg"}
    return {"regular": predicted.regular, "numbers": numbers, "attitude": attitude}


def biased(vantage, name: str) -> list[dict]:
    """By what the bias of first order is off that of a refit without noise, in the measure of the information."""
    from fitting.sensitivity.analysis import analysed

    leaf = next(leaf for leaf in vantage.satellite.leaves if leaf.name == name)
    rows = []
    for size in SIZES[name]:
        predicted = analysed(vantage, FREE, [f"{name}={size}"])
        quiet = np.zeros(vantage.slopes.residual.shape)
        off, turns = refitted(vantage, predicted, {name: size / leaf.to_unit}, quiet)
        sigma = np.array([row.sigma_noise for row in predicted.quoted.rows])
        told = predicted.quoted.shift[:, 0]
        table = predicted.bias_per_unit()[name]
        rows.append({
            "size": size,
            "unit": leaf.unit,
            "in_sigmas": float(np.linalg.norm(off / sigma)),
            "off": float(np.linalg.norm((told - off) / sigma) / np.linalg.norm(off / sigma)),
            "attitude_deg": float(np.degrees(np.sqrt((turns**2).mean()))),
            "attitude_predicted_deg": abs(table["attitude_rms_deg"] * size),
            "holds_to": predicted.linearity[-1].holds_to,
        })  # fmt: skip
    return rows


def refitted(vantage, predicted, shifts: dict, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the solver finds less the truth: numbers in their units, and the angle of the attitude [samples, rad].

    The truth is the plan's own but for `shifts` of some leaves, SI; it starts from the nominal numbers.
    """
    from scipy.spatial.transform import Rotation

    from fitting.measurements.abstract import RATE_UNIT
    from fitting.measurements.groups import columns_of
    from fitting.solvers.refine import PLAIN
    from fitting.starts.multi_start import Stage, solve

    problem, parameters = vantage.problem, predicted.choice.parameters
    numbers = {leaf.name: k for k, leaf in enumerate(vantage.satellite.leaves)}
    true = vantage.at(np.zeros(6), {numbers[name]: value for name, value in shifts.items()})
    valid, sigma = np.asarray(problem.valid), np.asarray(problem.sigma)
    change = np.zeros((len(valid), problem.channels))
    change[valid] = (true.residual + noise) * sigma
    measured = {
        group.name: np.asarray(problem.measured[group.name]) + change[:, columns]
        for group, columns in zip(problem.groups, columns_of(problem.groups), strict=True)
    }
    x = np.zeros((1, len(parameters.everything)))
    x[0, 3:6] = vantage.rate / RATE_UNIT
    stage = Stage(int(np.flatnonzero(valid)[-1]), 1, 40, PLAIN, parameters.everything)
    own = replace(problem, measured=measured)
    point = solve(own, parameters, stage, x, vantage.quaternion[None], vantage.weight)
    start = Rotation.from_quat(vantage.quaternion, scalar_first=True)
    turned = start.inv() * Rotation.from_quat(point.reference[0], scalar_first=True)
    moved = np.concatenate([turned.as_rotvec(), point.x[0, 3:] - x[0, 3:]])
    off = predicted.quoted.slopes @ moved[predicted.choice.kept]
    found = Rotation.from_quat(point.prediction.quaternion[0, valid], scalar_first=True)
    return off, (Rotation.from_quat(true.quaternion, scalar_first=True).inv() * found).magnitude()


if __name__ == "__main__":
    main()
