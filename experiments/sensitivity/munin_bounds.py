"""Cramér-Rao bounds of Munin's panel currents over arcs of 650, 2700 and 4500 s, beside those of another program.

2 mA of noise, 64 s between samples, no albedo, 11 turns an orbit about an axis 12 deg off the field; each group of
numbers is free with the start alone, and has next to no prior. Theirs is `KNOWN`: the attitude where it is known worst
on the arc. The start's azimuth about the field, which is not told, is 0 for that of `jaxsat simulate` here.

    .venv/bin/python -m experiments.sensitivity.munin_bounds --azimuth 120 --out sensitivity
"""

import argparse
import json
import tomllib
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

ARCS_S = (650.0, 2700.0, 4500.0)
START = {
    "quaternion": (0.485965764, -0.227725618, 0.164900991, -0.827517965),
    "rate_deg_s": (0.597000, 0.0, 0.0),
    "every_s": 64.0,
}
ELEMENTS = {"a_km": 7630.026457, "e": 0.072661, "i_deg": 95.438873, "raan_deg": 64.81879, "argp_deg": 16.675906}
MEAN_ANOMALY_DEG, EPOCH = 184.661752, "2001-01-18T04:54:15Z"
KNOWN = {
    "attitude, deg": (0.51, 0.27, 0.24),
    "imax, %": (0.25, 0.13, 0.12),
    "rods, A m2": (0.0113, 0.0019, 0.0014),
    "inertia, worst of its diagonal, %": (17.0, 0.6, 0.32),
}
LOOSE = 100.0
"""Times the priors of the satellite file."""


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("sensitivity"))
    parser.add_argument("--azimuth", type=float, default=0.0, help="of the start about the field, deg")
    asked = parser.parse_args()
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from fitting.sensitivity.analysis import analysed
    from fitting.sensitivity.plan import vantage_of_plan
    from jaxsat.satellites.satellite import satellite_of
    from jaxsat.synthetic.twins import TwinSettings

    satellite = satellite_of(munin(), Path("munin.sat.toml"))
    wide = tuple(replace(leaf, sigma=LOOSE * leaf.loose, loose=LOOSE * leaf.loose) for leaf in satellite.leaves)
    satellite = replace(satellite, leaves=wide)
    found: dict[str, list[list[float]]] = {name: [] for name in KNOWN}
    first = vantage_of_plan(satellite, TwinSettings.model_validate({"duration_s": ARCS_S[0], **START}))
    start = {**START, "quaternion": turned(np.asarray(first.problem.sky.b_field_eci)[0], asked.azimuth)}
    for arc in ARCS_S:
        vantage = vantage_of_plan(satellite, TwinSettings.model_validate({"duration_s": arc, **start}))
        found["attitude, deg"].append([float(analysed(vantage, ["state"]).attitude_sigma_deg[0].max())])
        for name, group, unit in (("imax, %", "imax", 100.0 / 240.0), ("rods, A m2", "rods", 1.0)):
            rows = analysed(vantage, [group]).quoted.rows[6:]
            found[name].append([unit * row.sigma for row in rows])
        rows = analysed(vantage, ["inertia"]).quoted.rows[6:9]
        found["inertia, worst of its diagonal, %"].append([max(100.0 * row.sigma / row.value for row in rows)])
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "munin-bounds.json").write_text(
        json.dumps({"arcs_s": ARCS_S, "known": KNOWN, "found": found}, indent=1)
    )
    for name, known in KNOWN.items():
        shown = "; ".join(
            f"{' and '.join(f'{x:.3g}' for x in own)} ({theirs:g})"
            for own, theirs in zip(found[name], known, strict=True)
        )
        print(f"{name}: {shown}")


def turned(field_eci: np.ndarray, azimuth_deg: float) -> tuple[float, ...]:
    """The start's attitude, turned about the field."""
    turn = Rotation.from_rotvec(np.radians(azimuth_deg) * field_eci / np.linalg.norm(field_eci))
    found = turn * Rotation.from_quat(START["quaternion"], scalar_first=True)
    return tuple(found.as_quat(scalar_first=True).tolist())


def munin() -> dict:
    """The tables of Munin's file with panel currents alone, the paper's numbers, and elements in place of positions."""
    tables = tomllib.loads(files("jaxsat.satellites").joinpath("munin.sat.toml").read_text("utf-8"))
    tables["orbit"] = {"elements": {**ELEMENTS, "mean_anomaly_deg": MEAN_ANOMALY_DEG, "epoch": EPOCH}}
    tables["time"] = {"column": "utc"}
    tables["albedo"] = {"diffuse": 0.0}
    tables["sensors"] = {"cells": tables["sensors"]["cells"]}
    tables["channels"] = {"cells": {**tables["channels"]["cells"], "sigma": 2.0}}
    tables["channels"]["cells"].pop("quantum")
    return tables


if __name__ == "__main__":
    main()
