"""Magnet and hysteresis rods of a 1U by slopes of the wobble that is left, checked by dispersed cases.

A 1U in IGRF-14 at 500 km whose magnet is to follow the field. Beside a sizing by rule of thumb, a magnet of 0.03 A m^2
and per axis three rods of 1 mm x 95 mm with their apparent loop (12 A/m, 0.004 T, 0.025 T: Gerhardt & Palo 2010, who
built a 3U so), the dipole and the rods' volume follow the slopes of the mean over starts of the logarithm of the mean
square angle between magnet and field over the last two orbits of eight. Exact derivatives through the motion are shown
beside differences: they are those of the motion, and of no use, for what the phase of the wobble does to an angle grows
over half a day beyond what the sizing does. Slopes are hence differences of the average of the same starts over 10 %.
Then cases that tumble at the start, with inertia and loops off, are run in both sizings for 12 orbits.

    .venv/bin/python -m experiments.sensitivity.passive_sizing --cases 1000 --out sensitivity
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import Surroundings, igrf_field, orbit_from_elements_km_deg
from jaxsat.integrators import StepGrid
from jaxsat.math import quaternion
from jaxsat.plotting.style import FAINT, INK, dress, head, new_figure, png_bytes
from jaxsat.simulate import simulate_on_grid
from jaxsat.spacecraft import HysteresisRods, Spacecraft
from jaxsat.torques import lag_from_induction

INERTIA = np.array([1.6e-3, 1.7e-3, 1.8e-3])
TEXTBOOK = np.log([0.03, 3 * 7.46e-8])
"""Logarithms of the dipole [A m^2] and of the volume of the rods along y, and of those along z [m^3]."""
BOUNDS = [tuple(np.log([0.005, 0.3])), tuple(np.log([2e-8, 12 * 7.46e-8]))]
"""At most twelve rods an axis: 15 g of all."""
LOOP = np.array([12.0, 0.004, 0.025])
PERIOD_S, STEP_S = 5677.0, 6.0
DESIGN_ORBITS, CHECK_ORBITS = 8, 12
HELD, TUMBLING = 0.001, 0.035
"""1-sigma of the rate about each axis [rad/s]."""
OFF_FIELD = 0.5
"""Of the magnet at a start from which derivatives are taken [rad]."""
STRIDE = 0.1
"""Of the logarithms, between which slopes are taken."""
STARTS, CHUNK, SETTLED_DEG = 8, 125, 5.0
ORBIT = orbit_from_elements_km_deg(a_km=6878.0, e=0.001, i_deg=97.4, raan_deg=64.8, argp_deg=16.7, mean_anomaly_deg=0.0)


def wobble(design, start, grid, table) -> Float[Array, ""]:
    """Mean of 2 (1 - cos) of the angle between magnet and field at the grid's samples [rad^2]."""
    q, w, inertia, loop = start
    coercive, remanence, saturation = LOOP * loop
    ones = jnp.ones(2)
    rods = HysteresisRods(
        jnp.eye(3)[1:], jnp.exp(design[1]) * ones, coercive * ones, remanence * ones, saturation * ones
    )
    craft = Spacecraft(jnp.diag(INERTIA * inertia), jnp.exp(design[0]) * jnp.eye(3)[0], hysteresis_rods=rods)
    b = jnp.asarray(table.b_field_eci)
    lag = lag_from_induction(rods, jnp.zeros(2), quaternion.rotate_inverse(q, b[0]))
    motion = simulate_on_grid(craft, AttitudeState(q, w, lag), table, grid)
    b = b[grid.sample_node]
    magnet = jax.vmap(lambda q: quaternion.rotate(q, jnp.eye(3)[0]))(motion.quaternion)
    return jnp.mean(2.0 - 2.0 * jnp.sum(magnet * b, axis=1) / jnp.linalg.norm(b, axis=1))


@eqx.filter_jit
def wobbles(design, starts, grid, table):
    return jax.vmap(lambda start: wobble(design, start, grid, table))(starts)


@eqx.filter_jit
def slopes(design, starts, grid, table):
    def one(start):
        return jax.jacfwd(lambda x: (lambda y: (y, y))(jnp.log(wobble(x, start, grid, table))), has_aux=True)(design)

    return jax.vmap(one)(starts)


def laid(orbits: float, step: float = STEP_S):
    """Grid with samples each minute of the last two orbits, and the table of its nodes."""
    times = np.arange((orbits - 2) * PERIOD_S, orbits * PERIOD_S, 60.0)
    grid = StepGrid.through(times, start=0.0, max_step=step)
    around = Surroundings(ORBIT, igrf_field(2020.0), greenwich_angle_0=1.0, field_rate=True)
    return grid, eqx.filter_jit(lambda nodes: around(nodes))(jnp.asarray(grid.node_times))


def drawn(count: int, rate: float, spread: float, seed: int, off_field=None):
    """Any attitude, or the magnet `off_field` [rad] off a direction; rate about each axis; all else off by `spread`."""
    rng = np.random.default_rng(seed)
    attitude = Rotation.random(count, rng=rng)
    if off_field is not None:
        angle, field = off_field
        across = np.cross(rng.normal(size=(count, 3)), field)
        tilt = Rotation.from_rotvec(angle * across / np.linalg.norm(across, axis=1, keepdims=True))
        roll = Rotation.from_rotvec(rng.uniform(0.0, 2.0 * np.pi, size=(count, 1)) * [[1.0, 0.0, 0.0]])
        along = Rotation.align_vectors(np.reshape(field, (1, 3)), [[1.0, 0.0, 0.0]])[0]
        attitude = tilt * along * roll
    q = attitude.as_quat(scalar_first=True)
    w = rate * rng.normal(size=(count, 3))
    inertia, loop = (
        1.0 + spread * rng.uniform(-1.0, 1.0, size=(count, 3)),
        1.0 + 2.0 * spread * rng.uniform(-1.0, 1.0, size=(count, 3)),
    )
    return tuple(jnp.asarray(each) for each in (q, w, inertia, loop))


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--out", type=Path, default=Path("sensitivity"))
    asked = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    began = time.perf_counter()
    at = laid(DESIGN_ORBITS)
    field = np.asarray(at[1].b_field_eci)[0]
    held = drawn(STARTS, HELD, 0.0, 1, (OFF_FIELD, field / np.linalg.norm(field)))
    # What is left of a tumble is a spin about the magnet, which the rods across it hardly damp.
    held = (held[0], held[1].at[:, 0].set(jnp.linspace(-TUMBLING, TUMBLING, STARTS)), *held[2:])
    tumbling = drawn(STARTS, TUMBLING, 0.0, 1)
    found: dict[str, Any] = {
        "slopes": {name: checked(starts, at) for name, starts in (("held", held), ("tumbling", tumbling))}
    }
    print(json.dumps(found), flush=True)
    trail = []

    def level(design):
        return float(np.mean(np.log(wobbles(jnp.asarray(design), held, *at))))

    def cost(design):
        value = level(design)
        gradient = [(level(design + e) - level(design - e)) / (2.0 * STRIDE) for e in STRIDE * np.eye(2)]
        trail.append([*np.exp(design).tolist(), float(np.degrees(np.exp(0.5 * value))), *gradient])
        print(trail[-1], flush=True)
        return value, np.array(gradient)

    best = minimize(cost, TEXTBOOK, jac=True, bounds=BOUNDS, method="L-BFGS-B", options={"maxiter": 8, "maxfun": 12})
    best = np.log(min(trail, key=lambda row: row[2])[:2])
    found["trail"], found["seconds_design"] = trail, time.perf_counter() - began
    at = laid(CHECK_ORBITS)
    cases = drawn(asked.cases, TUMBLING, 0.1, 2)
    angles = {name: dispersed(x, cases, at) for name, x in (("textbook", TEXTBOOK), ("designed", best))}
    found["cases"] = {
        name: {
            "dipole_A_m2": float(np.exp(x[0])),
            "volume_m3": float(np.exp(x[1])),
            "median_deg": float(np.median(angle)),
            "p95_deg": float(np.percentile(angle, 95)),
            "settled": int((angle < SETTLED_DEG).sum()),
            "of": len(angle),
        }
        for (name, angle), x in zip(angles.items(), (TEXTBOOK, best), strict=True)
    }
    found["seconds"] = time.perf_counter() - began
    asked.out.mkdir(parents=True, exist_ok=True)
    (asked.out / "passive_sizing.json").write_text(json.dumps(found, indent=1))
    (asked.out / "passive_sizing.png").write_bytes(picture(found, angles))
    print(json.dumps(found["cases"], indent=1), found["seconds"])


def checked(starts, at) -> dict:
    """Derivatives of ln wobble at the textbook sizing beside differences, both over the starts."""
    own = np.asarray(slopes(jnp.asarray(TEXTBOOK), starts, *at)[0])

    def difference(step):
        rows = []
        for change in step * np.eye(2):
            high, low = (np.log(wobbles(jnp.asarray(TEXTBOOK + s * change), starts, *at)) for s in (1.0, -1.0))
            rows.append((np.asarray(high) - np.asarray(low)) / (2.0 * step))
        return np.array(rows).T

    small, large = difference(1e-6), difference(0.1)
    return {
        "derivative": own.tolist(),
        "difference_1e-6": small.tolist(),
        "difference_0.1": large.tolist(),
        "median": np.median(own, axis=0).tolist(),
        "median_difference_0.1": np.median(large, axis=0).tolist(),
        "largest": float(np.abs(own).max()),
        "off_small": float(np.median(np.abs(own - small) / np.abs(small))),
    }


def dispersed(design, cases, at) -> np.ndarray:
    """RMS angle to the field over the last two orbits of each case [deg]."""
    chunks = [
        wobbles(jnp.asarray(design), tuple(each[k : k + CHUNK] for each in cases), *at)
        for k in range(0, len(cases[0]), CHUNK)
    ]
    return np.degrees(np.sqrt(np.concatenate([np.asarray(each) for each in chunks])))


def picture(found: dict, angles: dict[str, np.ndarray]) -> bytes:
    """PNG content."""
    subtitle = f"1U, 500 km; {len(angles['textbook'])} cases tumbling at the start, 12 orbits; synthetic"
    figure = new_figure(8.6, 3.9, "Magnet and hysteresis rods by slopes of the wobble that is left", subtitle)
    left, right = figure.subplots(
        1, 2, gridspec_kw={"left": 0.11, "right": 0.975, "top": 0.78, "bottom": 0.14, "wspace": 0.28}
    )
    trail = np.array(found["trail"])
    left.loglog(1e9 * trail[:, 1], trail[:, 0], "o-", markersize=3.5, linewidth=0.9, color=INK)
    for k in (0, int(np.argmin(trail[:, 2]))):
        left.annotate(
            f"{trail[k, 2]:.1f}°",
            (1e9 * trail[k, 1], trail[k, 0]),
            fontsize=8,
            xytext=(-22, 5),
            textcoords="offset points",
        )
    dress(left, x_label="rods along an axis, mm³", y_label="dipole, A m²")
    head(left, "The descent, and the wobble that is left")
    for name, colour in (("textbook", FAINT), ("designed", "#c0392b")):
        right.plot(np.sort(angles[name]), np.linspace(0.0, 100.0, len(angles[name])), color=colour, label=name)
    right.set_xlim(0.0, 20.0)
    right.legend(fontsize=8, frameon=False)
    dress(right, x_label="RMS angle to the field over the last two orbits, deg", y_label="% of cases")
    head(right, "Dispersed cases")
    return png_bytes(figure)


if __name__ == "__main__":
    main()
