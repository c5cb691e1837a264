"""Magnet and hysteresis rods of a 3U by slopes of its mean wobble through four days, checked by 1000 dispersed cases.

A 3U with the inertia and the orbit of CSSWE is to keep a body axis within 15 degrees of the field. Beside what that
satellite carried by the rules of the textbook (Gerhardt & Palo 2010, after Santoni & Zelli 2009: a dipole of ten times
the disturbing torques, 0.3 A m^2; three rods of 1 mm x 95 mm along each axis), dipole and rods follow the slopes of

    mean over starts of the RMS angle between magnet and field over the last orbits [deg] + price [deg/g] x mass [g].

From a tumble exact derivatives are no guide, as is shown; slopes are those of the mean over starts and over a small
spread of the designs (`fitting.sensitivity.means.slopes_of_runs`). Of captured satellites exact derivatives are
good, and say what the wobble that is left is made of.

    .venv/bin/python -m experiments.sensitivity.passive_sizing --cases 1000 --out sensitivity
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from experiments.sensitivity.passive_derivatives import captured_slopes, tumbling_slopes
from experiments.sensitivity.passive_motion import Numbers, Orbits, by_orbit, demagnetised, laid
from experiments.sensitivity.passive_picture import picture
from fitting.sensitivity.design import descended
from fitting.sensitivity.means import slopes_of_runs
from jaxsat.constants import VACUUM_PERMEABILITY
from jaxsat.environment import ExponentialAtmosphere, Surroundings, igrf_field, orbit_from_elements_km_deg

INERTIA = np.array([0.00551, 0.02552, 0.02565])
"""[kg m^2], the least about the long axis, along which the magnet lies."""
ROD = np.pi * 0.0005**2 * 0.095
"""Volume of a rod of 1 mm x 95 mm [m^3]."""
LOOP = np.array([12.0, 0.004, 0.025])
"""Apparent coercive field [A/m], remanence and saturation [T] of such a rod of HyMu-80 (Gerhardt & Palo 2010)."""
REMANENCE, MAGNET_DENSITY, ROD_DENSITY = 1.2, 7500.0, 8700.0
"""Of NdFeB [T, kg/m^3], and of HyMu-80 [kg/m^3]."""
TEXTBOOK = np.log([0.3, 3.0, 3.0])
"""Logarithms of the dipole [A m^2], of the number of rods along y and of that along z."""
LOW, HIGH = np.log([0.02, 1.5, 1.5]), np.log([0.6, 16.0, 16.0])
PRICE = 0.25
"""Of a gram, in degrees of mean wobble."""
ORBITS, LAST, SETTLED_DEG = 60, 4, 15.0
"""Four days; over which the wobble is taken; what is called settled."""
PERIOD_S, STEP_S, RATE_DEG_S = 5832.0, 4.0, 2.0
"""The rate is the 1-sigma of the tumble about each axis."""
STARTS, WIDTH, STEPS, STRIDE, CHUNK = 96, 0.2, 12, 0.5, 48
ORBIT = orbit_from_elements_km_deg(a_km=7003.0, e=0.022, i_deg=64.7, raan_deg=60.0, argp_deg=20.0, mean_anomaly_deg=0.0)


def mass_g(designs: np.ndarray) -> np.ndarray:
    """Of magnet and rods, of designs [..., 3]."""
    dipole, y, z = np.moveaxis(np.exp(designs), -1, 0)
    return 1e3 * (dipole * VACUUM_PERMEABILITY / REMANENCE * MAGNET_DENSITY + (y + z) * ROD * ROD_DENSITY)


def orbits_of(count: int, step: float = STEP_S, first: int = 0) -> Orbits:
    """IGRF-14 and a mean atmosphere along the orbit."""
    air = ExponentialAtmosphere()
    around = Surroundings(ORBIT, igrf_field(2013.0), greenwich_angle_0=1.0, field_rate=True, atmosphere=air)
    return laid(around, count, PERIOD_S, step, first=first)


def dispersed(count: int, seed: int) -> dict[str, np.ndarray]:
    """Starts: any attitude, a tumble; moments off by 5 %, loops by 20 %, and the air off the centre by up to 2 cm."""
    rng = np.random.default_rng(seed)
    return {
        "q": Rotation.random(count, rng=rng).as_quat(scalar_first=True),
        "w": np.radians(RATE_DEG_S) * rng.normal(size=(count, 3)),
        "inertia": INERTIA * (1.0 + 0.05 * rng.uniform(-1.0, 1.0, size=(count, 3))),
        "loop": LOOP * (1.0 + 0.2 * rng.uniform(-1.0, 1.0, size=(count, 3))),
        "centre": np.array([0.02, 0.005, 0.005]) * rng.uniform(-1.0, 1.0, size=(count, 3)),
    }


def numbers_of(designs: np.ndarray, starts: dict[str, np.ndarray]) -> Numbers:
    """Those of each start with its own design [starts, 3]."""
    dipole, rods = np.exp(designs[:, 0]), ROD * np.exp(designs[:, 1:])
    return Numbers(starts["inertia"], dipole, rods, starts["loop"], starts["centre"])


def flown(designs: np.ndarray, starts: dict[str, np.ndarray], orbits: Orbits):
    """RMS angle of each start over each orbit [deg], and where all ended."""
    numbers = numbers_of(designs, starts)
    means, end = by_orbit(numbers, demagnetised(numbers, starts["q"], starts["w"], orbits), orbits, chunk=CHUNK)
    return np.degrees(np.sqrt(means[..., 0])), end


def wobble(angles: np.ndarray) -> np.ndarray:
    """RMS over the last orbits [deg] of angles [cases, orbits]."""
    return np.sqrt(np.mean(angles[:, -LAST:] ** 2, axis=1))


def settling_orbits(angles: np.ndarray, limit: float) -> np.ndarray:
    """[cases] orbits after which the RMS angle stays below a limit; infinite where the last one is above."""
    above = angles >= limit
    last = angles.shape[1] - np.argmax(above[:, ::-1], axis=1)
    return np.where(above.any(axis=1), np.where(above[:, -1], np.inf, last.astype(float)), 0.0)


def told(design: np.ndarray, angles: np.ndarray) -> dict[str, Any]:
    """What became of dispersed cases of a design."""
    left, settled = wobble(angles), settling_orbits(angles, SETTLED_DEG)
    return {
        "dipole_A_m2": float(np.exp(design[0])),
        "rods": np.exp(design[1:]).round(3).tolist(),
        "mass_g": float(mass_g(design)),
        "wobble_mean_deg": float(left.mean()),
        "wobble_rms_deg": float(np.sqrt(np.mean(left**2))),
        "wobble_median_deg": float(np.median(left)),
        "wobble_p95_deg": float(np.percentile(left, 95)),
        "settled": int(np.isfinite(settled).sum()),
        "settling_orbits_median": _finite(np.percentile(settled, 50, method="higher")),
        "settling_orbits_p95": _finite(np.percentile(settled, 95, method="higher")),
        "of": len(left),
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def descent(orbits: Orbits, price: float, starts: dict[str, np.ndarray]):
    """A design along the slopes of the mean from the textbook's, and the way there."""

    def slopes_at(design, number):
        def cost(moved):
            return {"cost": wobble(flown(design + moved, starts, orbits)[0]) + price * mass_g(design + moved)}

        # At once: a chaotic motion is noise to every slope, whatever moves it.
        settings = {"width": WIDTH, "seed": number, "together": True}
        found = slopes_of_runs(cost, len(design), len(starts["q"]), **settings)["cost"]
        print(np.exp(design).round(3), round(found.mean, 2), found.slopes.round(2), found.sigma.round(2), flush=True)
        return found

    return descended(slopes_at, TEXTBOOK, low=LOW, high=HIGH, step=STRIDE, steps=STEPS)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=Path("sensitivity"))
    asked = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    began, found = time.perf_counter(), dict[str, Any]()
    orbits = orbits_of(ORBITS)
    best, way = descent(orbits, PRICE, dispersed(STARTS, 1))
    found["way"] = [
        {
            "dipole_A_m2": float(np.exp(x[0])),
            "rods": np.exp(x[1:]).tolist(),
            "cost_deg": m.mean,
            "slopes_deg": m.slopes.tolist(),
            "sigma_deg": m.sigma.tolist(),
        }
        for x, m in way
    ]
    found["seconds_design"] = time.perf_counter() - began
    # Whole rods, and the textbook's magnet with as much mass.
    best = np.array([best[0], *np.log(np.round(np.exp(best[1:])))])
    spare = mass_g(best) - mass_g(np.array([TEXTBOOK[0], -np.inf, -np.inf]))
    more = np.log(spare / (2e3 * ROD * ROD_DENSITY))
    designs = {"textbook": TEXTBOOK, "its magnet, more rods": np.array([TEXTBOOK[0], more, more]), "by slopes": best}
    starts = dispersed(asked.cases, 2)
    angles, ends = {}, {}
    for name, design in designs.items():
        angles[name], ends[name] = flown(np.tile(design, (asked.cases, 1)), starts, orbits)
        found.setdefault("cases", {})[name] = told(design, angles[name])
        print(name, json.dumps(found["cases"][name]), flush=True)
    few = {name: each[: 8 * CHUNK] for name, each in starts.items()}
    for name, by in (("dipole / 1.5", -1.0), ("dipole x 1.5", 1.0)):
        design = best + np.array([by * np.log(1.5), 0.0, 0.0])
        beside = flown(np.tile(design, (len(few["q"]), 1)), few, orbits)[0]
        found.setdefault("beside", {})[name] = told(design, beside)
    found["finer"] = finer(best, starts, angles["by slopes"], min(asked.cases, 4 * CHUNK))
    print(json.dumps(found["finer"]), flush=True)
    settled = np.flatnonzero(wobble(angles["by slopes"]) < SETTLED_DEG)[:16]
    few = {name: each[settled] for name, each in starts.items()}
    end = jax.tree.map(lambda leaf: np.asarray(leaf)[settled], ends["by slopes"])
    found["captured"] = captured_slopes(
        numbers_of(np.tile(best, (len(settled), 1)), few), end, orbits_of(12, first=ORBITS)
    )
    few = {name: each[:16] for name, each in starts.items()}
    numbers = numbers_of(np.tile(TEXTBOOK, (16, 1)), few)
    start = demagnetised(numbers, few["q"], few["w"], orbits)
    found["tumbling"] = tumbling_slopes(numbers, start, orbits._replace(tables=orbits.tables[:12]))
    found["seconds"] = time.perf_counter() - began
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "passive_sizing.json").write_text(json.dumps(found, indent=1))
    (asked.out / "passive_sizing.png").write_bytes(picture(found, angles))
    print(json.dumps({name: found[name] for name in ("captured", "tumbling")}), round(found["seconds"]), "s")


def finer(design: np.ndarray, starts: dict[str, np.ndarray], angles: np.ndarray, count: int) -> dict[str, Any]:
    """The first cases again in half the steps: each motion is another, being chaotic; what becomes of all is not."""
    few = {name: each[:count] for name, each in starts.items()}
    half, _ = flown(np.tile(design, (count, 1)), few, orbits_of(ORBITS, STEP_S / 2.0))
    off = np.log(wobble(half) / wobble(angles[:count]))
    return {
        "steps": told(design, angles[:count]),
        "half": told(design, half),
        "first_orbit_deg": float(np.abs(half[:, 0] - angles[:count, 0]).max()),
        "log_ratio_mean": float(off.mean()),
        "log_ratio_sigma": float(off.std(ddof=1) / np.sqrt(count)),
    }


if __name__ == "__main__":
    main()
