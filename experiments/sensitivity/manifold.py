"""How many samples, how long an arc, how many free numbers: where a fit of Munin's panel currents tunes itself to data.

Sessions of panel currents on the orbit and with the noise of the bundled session, the satellite drawn from the priors
of its file for what is free: fitted, from the truth, by the solver of `jaxsat fit`, to the first 5 ... 140 samples of
64 s, and to 6 ... 141 samples of one arc of 640 s, with 7 to 36 free numbers, under the file's priors and under
priors a hundred times as wide. Each fit is compared with its truth and with the ten samples that come next. On half of
the sessions (the bundled one's start) a threshold is tuned, on the others (any start) it and the rule are tried.

    .venv/bin/python -m experiments.sensitivity.manifold --out manifold
"""

import argparse
import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

COUNTS = (5, 10, 20, 30, 40, 71, 100, 140)
PROFILED = (5, 10, 20, 40, 71, 140)
DENSE_S, DENSE, STRIDES = 640.0, 141, (28, 14, 7, 4, 2, 1)
"""The short arc, its most samples, and every how many of them are fitted."""
HELD = 10
"""Samples that are predicted."""
EVERYTHING = "+ gains, tilts"
SETS = {
    "start, imax": ["imax"],
    "+ magnet, rods": ["imax", "magnet", "rods"],
    "+ inertia, albedo": ["imax", "magnet", "rods", "inertia", "albedo.specular"],
    EVERYTHING: ["imax", "magnet", "rods", "inertia", "albedo.specular", "gains", "tilts"],
}
WHOLE = "+ inertia, albedo"
WIDTHS = {"priors of the file": 1.0, "next to none": 100.0}
PROFILES = ("attitude.y", "imax", "rods.y")
QUATERNION = (0.40869641036874227, 0.11117947053186873, -0.6106432398699952, -0.669119722534789)
RATE = (0.012574393701868877, 0.0011353344034219124, -2.494903597312493e-05)
"""Start of the bundled session b, the rate [rad/s]."""
FASTEST = (np.radians(0.2), np.radians(0.9))
"""Rates of the other starts [rad/s]."""
ALBEDO = {"specular": {"value": 0.5, "sigma": 0.15}, "diffuse": 0.0}
"""About that of the bundled session; the bound at zero is three sigmas away."""


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=10, help="with the bundled start, and as many with any start")
    parser.add_argument("--sets", type=int, default=len(SETS), help="of the numbers that are free, smallest first")
    parser.add_argument("--profiled", type=int, default=2, help="of the first, that are profiled")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="two sessions, no profiles")
    parser.add_argument("--out", type=Path, default=Path("manifold"))
    asked = parser.parse_args()
    sessions, profiled = (1, 0) if asked.quick else (asked.sessions, asked.profiled)
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from experiments.sensitivity.manifold_picture import picture
    from experiments.sensitivity.manifold_rule import judged

    began = time.perf_counter()
    study = Study(asked.seed, asked.sets)
    found: dict[str, Any] = {"sets": SETS, "widths": WIDTHS, "sessions": sessions, "fits": [], "profiles": []}
    asked.out.mkdir(parents=True, exist_ok=True)
    for number in range(sessions):
        both = [(number, kind) for kind in ("tuned on", "tried on")]
        # The first alone: it compiles what the others run.
        with ThreadPoolExecutor(1 if number == 0 else 2) as pool:
            for rows, profiles in pool.map(lambda each: study.session(each[0], each[1], profiled > each[0]), both):
                found["fits"] += rows
                found["profiles"] += profiles
        found["seconds"] = time.perf_counter() - began
        found["rule"] = judged(found["fits"])
        (asked.out / "manifold.json").write_text(json.dumps(found, indent=1))
        print(f"{number + 1} of {sessions} pairs of sessions, {found['seconds']:.0f} s", flush=True)
    (asked.out / "manifold.png").write_bytes(picture(found))
    for line in found["rule"]["lines"]:
        print(line)


class Study:
    """The satellite under each width of its priors, and the two rows of instants."""

    def __init__(self, seed: int, sets: int):
        from experiments.sensitivity.manifold_fits import EVERY_S, row_of
        from experiments.sensitivity.munin_bounds import munin
        from jaxsat.satellites.satellite import satellite_of

        self.seed, self.sets = seed, dict(list(SETS.items())[:sets])
        satellite = satellite_of({**munin(), "albedo": ALBEDO}, Path("munin.sat.toml"))
        self.satellites = {name: widened(satellite, width) for name, width in WIDTHS.items()}
        t = EVERY_S * np.arange(max(COUNTS) + HELD + 1)
        short = np.concatenate([np.linspace(0.0, DENSE_S, DENSE), DENSE_S + EVERY_S * np.arange(1, HELD + 1)])
        every = [np.arange(0, DENSE, stride) for stride in STRIDES]
        self.rows = (
            row_of(satellite, "longer arc", t, {count: np.arange(count) for count in COUNTS}, HELD),
            row_of(satellite, "one arc", short, {len(index): index for index in every}, HELD),
        )

    def session(self, number: int, kind: str, profiled: bool) -> tuple[list[dict], list[dict]]:
        """All fits of one session, and the profiles where it has some."""
        from experiments.sensitivity.manifold_fits import Truth, fits, numbers_of_priors, parameters_of
        from fitting.measurements.abstract import RATE_UNIT

        fitted, profiles = [], []
        for k, (name, free) in enumerate(self.sets.items()):
            # The same truth and noise under each width; others for each set, whose other numbers are nominal.
            random = np.random.default_rng([self.seed, number, kind == "tried on", k])
            q, w = start(random, kind)
            nominal = parameters_of(self.satellites["priors of the file"], free)
            numbers = numbers_of_priors(nominal, random)
            noise = [random.normal(size=row.weight.shape) for row in self.rows]
            for width, satellite in self.satellites.items():
                parameters = parameters_of(satellite, free)
                x = np.concatenate([np.zeros(3), w / RATE_UNIT, numbers / WIDTHS[width]])
                for row, own in zip(self.rows, noise, strict=True):
                    if name != WHOLE and (row is not self.rows[0] or WIDTHS[width] > 1.0):
                        continue
                    about = {"session": number, "kind": kind, "set": name, "priors": width, "row": row.name}
                    rows, (problem, points) = fits(row, parameters, Truth(x, q, own))
                    for count, each in rows.items():
                        # In the sigmas of the file whatever the width.
                        each["walked"] *= WIDTHS[width]
                        fitted.append({**about, "samples": count, **each})
                    if profiled and kind == "tuned on" and name == WHOLE and row is self.rows[0]:
                        profiles += profiled_fits(problem, parameters, points, about)
        return fitted, profiles


def widened(satellite, width: float):
    """The satellite whose priors are so many times as wide."""
    leaves = tuple(
        replace(leaf, sigma=None if leaf.sigma is None else width * leaf.sigma, loose=width * leaf.loose)
        for leaf in satellite.leaves
    )
    return replace(satellite, leaves=leaves)


def start(random: np.random.Generator, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Attitude and rate [rad/s] at the first sample."""
    if kind == "tuned on":
        return np.array(QUATERNION), np.array(RATE)
    q, w = random.normal(size=4), random.normal(size=3)
    return q / np.linalg.norm(q), w / np.linalg.norm(w) * random.uniform(*FASTEST)


def profiled_fits(problem, parameters, points, about: dict) -> list[dict]:
    """Intervals of 68 % by the profile beside the sigma of the information."""
    import jax

    from fitting.profile.profile import profile
    from fitting.solvers.refine import Refined
    from jaxsat.errors import InputError

    found = []
    for count in PROFILED:
        alone = jax.tree.map(lambda leaf: np.asarray(leaf)[None], points[count])
        none = np.zeros((1, len(problem.valid), 1), bool)
        refined = Refined(alone, np.array([float(points[count].cost)]), none, np.zeros(1, bool))
        for name in PROFILES:
            each: dict[str, Any] = {**about, "samples": count, "name": name}
            try:
                told = profile(problem, parameters, refined, name)
            except InputError as error:
                found.append({**each, "reason": error.reason})
                continue
            lower, upper = told.interval_68
            each |= {"best": told.best, "sigma": told.sigma, "lower": lower, "upper": upper, "unit": told.unit}
            found.append({**each, "note": told.note})
    return found


if __name__ == "__main__":
    main()
