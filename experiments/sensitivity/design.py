"""When to sample, and where cells should look: designs by derivatives of a sigma, and what refits say of them.

Of the small satellite of this folder, which can send 12 of 91 samples: the 12 that make the attitude, or a component of
the dipole, best known, beside 12 evenly spaced ones. Of a spinner that looks at the Sun within 20 degrees: where three
cells should look, beside the faces +x, +y, +z, and beside three at right angles of which each sees the Sun. Simulated
sessions with noise are fitted in each design, and the errors compared with what was predicted.

    .venv/bin/python -m experiments.sensitivity.design --refits 200 --out sensitivity
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from experiments.sensitivity.refits import FREE, PLAN, SATELLITE, scattered

EVERY_S, SENT = 10.0, 12
AIMS = ("attitude", "magnet.x")
SPINNER = Path(__file__).parent / "spinner.sat.toml"
SPIN_DEG_S, OFF_SUN_DEG, STARTS = 5.0, 20.0, 4
SPIN_PLAN = {"duration_s": 900.0, "every_s": 15.0, "rate_deg_s": (0.0, 0.0, SPIN_DEG_S)}
DESCENTS = 6


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--refits", type=int, default=200, help="of each design")
    parser.add_argument("--out", type=Path, default=Path("sensitivity"))
    asked = parser.parse_args()
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    began = time.perf_counter()
    found = {"refits": asked.refits, "free": FREE, "times": times(asked.refits), "cells": cells(asked.refits)}
    found["seconds"] = time.perf_counter() - began
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "design.json").write_text(json.dumps(found, indent=1))
    from experiments.sensitivity.design_picture import picture

    (asked.out / "design.png").write_bytes(picture(found))
    for kind in ("times", "cells"):
        for design in found[kind]["designs"]:
            print(kind, design["name"], json.dumps({k: v for k, v in design.items() if k in ("sigma", "found")}))
    print(f"{found['seconds']:.0f} s")


def times(count: int) -> dict:
    """Designs of sampling times: predicted sigmas, the least that there can be, and what refits find."""
    from fitting.sensitivity.analysis import analysed
    from fitting.sensitivity.design import Candidates, best_weights, whole_samples
    from fitting.sensitivity.plan import vantage_of_plan
    from jaxsat.satellites import read_satellite
    from jaxsat.synthetic.twins import TwinSettings

    plan = TwinSettings(**{**PLAN, "every_s": EVERY_S})
    vantage = vantage_of_plan(read_satellite(SATELLITE), plan)
    place = analysed(vantage, FREE)
    candidates = {name: Candidates.of(place, name) for name in AIMS}
    number = len(candidates[AIMS[0]].told)
    chosen = {"evenly spaced": np.round(np.linspace(0, number - 1, SENT)).astype(int)}
    bounds = {}
    for name in AIMS:
        relaxed = best_weights(candidates[name], SENT)
        chosen[f"for {name}"] = whole_samples(candidates[name], relaxed.weights, SENT)
        bounds[name] = {"relaxed": relaxed.sigma, "bound": relaxed.bound, "weights": relaxed.weights.tolist()}
    designs = []
    for name, samples in chosen.items():
        on = np.isin(np.arange(len(vantage.weight)), samples).astype(float)
        told = scattered(replace(vantage, weight=vantage.weight * on[:, None]), FREE, [], count, 0)
        designs.append({
            "name": name,
            "t_s": (EVERY_S * samples).tolist(),
            "sigma": {aim: candidates[aim].sigma(on[:number]) for aim in AIMS},
            "found": {aim: {"attitude": told["attitude"], **told["numbers"]}[aim] for aim in AIMS},
        })  # fmt: skip
    return {"every_s": EVERY_S, "candidates": number, "sent": SENT, "bounds": bounds, "designs": designs}


def cells(count: int) -> dict:
    """Designs of directions of three cells; sigmas are the RMS over four starts about the Sun."""
    import equinox as eqx

    from fitting.sensitivity.analysis import analysed
    from fitting.sensitivity.design import best_directions, sigma_of_sensors
    from fitting.sensitivity.plan import vantage_of_plan
    from jaxsat.satellites import read_satellite
    from jaxsat.synthetic.twins import TwinSettings

    satellite = read_satellite(SPINNER)
    plans = [TwinSettings(**SPIN_PLAN, quaternion=tuple(q)) for q in starts_about_the_sun(satellite)]

    def put(model, normals):
        return eqx.tree_at(lambda m: m.sensors["sun"].normals, model, normals)

    places = [analysed(vantage_of_plan(satellite, plan), FREE) for plan in plans]
    sigma = sigma_of_sensors(places, put)
    azimuth = np.radians([0.0, 120.0, 240.0])
    corner = np.stack([np.sqrt(2.0) * np.cos(azimuth), np.sqrt(2.0) * np.sin(azimuth), np.ones(3)], axis=1) / np.sqrt(3)
    rng = np.random.default_rng(0)
    random = [corner + 0.7 * rng.normal(size=(3, 3)) for _ in range(DESCENTS - 2)]
    best, least = best_directions(sigma, [np.eye(3), corner, *random])
    slopes, steps = sigma(corner)[1], 1e-6
    differences = np.zeros((3, 3))
    for k in np.ndindex(3, 3):
        change = np.zeros((3, 3))
        change[k] = steps
        differences[k] = (sigma(corner + change)[0] - sigma(corner - change)[0]) / (2.0 * steps)
    designs = []
    for name, normals in {"faces": np.eye(3), "corner": corner, "designed": best}.items():
        changed = replace(satellite, model=put(satellite.model, normals))
        squares = []
        for number, plan in enumerate(plans):
            told = scattered(vantage_of_plan(changed, plan), FREE, [], max(count // STARTS, 2), 100 + number)
            squares.append([told["attitude"]["predicted"] ** 2, told["attitude"]["scatter"] ** 2])
        predicted, scatter = np.sqrt(np.mean(squares, axis=0))
        designs.append({
            "name": name,
            "normals": np.asarray(normals).tolist(),
            "off_sun_axis_deg": np.degrees(np.arccos(normals[:, 2])).tolist(),
            "sigma": {"attitude": sigma(normals)[0]},
            "found": {"attitude": {"predicted": predicted, "scatter": scatter, "ratio": scatter / predicted}},
        })  # fmt: skip
    worst = float(np.abs(slopes - differences).max() / np.abs(differences).max())
    return {"designs": designs, "least": least, "slopes_off": worst, "starts": STARTS}


def starts_about_the_sun(satellite) -> np.ndarray:
    """[starts 4] attitudes whose z axis is 20 degrees off the Sun on four sides."""
    from scipy.spatial.transform import Rotation

    from fitting.sensitivity.plan import around_at
    from jaxsat.synthetic.twins import TwinSettings
    from jaxsat.synthetic.twins.source import epoch_of

    epoch = epoch_of(satellite, TwinSettings(**SPIN_PLAN))
    sun = np.asarray(around_at(satellite, epoch, SPIN_PLAN["duration_s"]).sun_eci(epoch, np.zeros(1)))[0]
    to_sun = Rotation.align_vectors(sun[None], [[0.0, 0.0, 1.0]])[0]
    sides = Rotation.from_euler("ZY", [[360.0 * k / STARTS, OFF_SUN_DEG] for k in range(STARTS)], degrees=True)
    return (to_sun * sides).as_quat(scalar_first=True)


if __name__ == "__main__":
    main()
