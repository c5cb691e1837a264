"""How long satellites with hysteresis rods take, and where their energy goes.

A 1U with a magnet of 0.06 A m^2 and two rods, which leaves its launcher at some 6 deg/s, in IGRF-14 at 500 km. Run
`python -m experiments.hysteresis [--quick] [--out DIR]`; it writes hysteresis.json and hysteresis.png. Each
run is done twice and the second one counts: programs are compiled by then.
"""

import argparse
import json
import resource
import time
import warnings
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import Surroundings, igrf_field, orbit_from_elements_km_deg
from jaxsat.plotting.style import INK, LEFT_OUT, dress, new_figure, png_bytes
from jaxsat.simulate import Trajectory, simulate, simulate_many
from jaxsat.spacecraft import HysteresisRods, Spacecraft
from jaxsat.torques import hysteresis_dipole, lag_from_induction

jax.config.update("jax_enable_x64", True)
INERTIA = np.diag([1.6e-3, 1.7e-3, 1.8e-3])
MAGNET = np.array([0.06, 0.0, 0.0])
RODS = HysteresisRods(np.eye(3)[1:], np.full(2, 7.5e-8), np.full(2, 8.0), np.full(2, 0.02), np.full(2, 0.06))
CRAFT = Spacecraft(jnp.asarray(INERTIA), jnp.asarray(MAGNET), hysteresis_rods=RODS)
ORBIT = orbit_from_elements_km_deg(a_km=6878.0, e=0.001, i_deg=97.4, raan_deg=64.8, argp_deg=16.7, mean_anomaly_deg=0.0)
PERIOD = 5677.0
AROUND = Surroundings(ORBIT, igrf_field(2020.0), greenwich_angle_0=1.0)
MU = 3.986004418e14
HOUR, DAY = 3600.0, 86400.0


def states(count: int, seed: int) -> AttitudeState:
    """Random attitudes, 0.05 rad/s about each axis, rods without induction."""
    rng = np.random.default_rng(seed)
    q = Rotation.random(count, rng=rng)
    b = q.inv().apply(np.array(AROUND(np.zeros(1)).b_field_eci[0]))
    lag = jax.vmap(lambda b: lag_from_induction(RODS, jnp.zeros(2), b))(jnp.asarray(b))
    return AttitudeState(
        jnp.asarray(q.as_quat(scalar_first=True)), 0.05 * jnp.asarray(rng.normal(size=(count, 3))), lag
    )


def timed(run):
    """Result of the second of two runs, its seconds by the clock and of the processor."""
    run()
    clock, processor = time.perf_counter(), time.process_time()
    found = run()
    return found, {"clock_s": time.perf_counter() - clock, "processor_s": time.process_time() - processor}


def book(motion: Trajectory, times: np.ndarray) -> dict[str, np.ndarray]:
    """Entries of the energy book at the times since the first of them [J], worked out from attitudes and rates alone.

    The energies of motion, of the magnet and of the rods in the field; what the field's change along the orbit and the
    gravity gradient have done, by Simpson's rule; and the heat of the loops that the motion tells.
    """
    table = AROUND(times)
    step, b_eci = 1.0, np.array(table.b_field_eci)
    b_rate = np.array(AROUND(times + step).b_field_eci - AROUND(times - step).b_field_eci) / (2 * step)
    into_body = Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True).inv()
    w, b, b_rate = np.asarray(motion.angular_velocity), into_body.apply(b_eci), into_body.apply(b_rate)
    r = into_body.apply(np.array(table.position_eci))
    moment = MAGNET + np.asarray(jax.vmap(lambda z, b: hysteresis_dipole(RODS, z, b))(motion.rod_lag, jnp.asarray(b)))
    pull = 3 * MU / np.linalg.norm(r, axis=1, keepdims=True) ** 5 * np.cross(r, r @ INERTIA)
    entries = {
        "motion": 0.5 * np.einsum("ti,ij,tj->t", w, INERTIA, w),
        "in the field": -np.sum(moment * b, axis=1),
        "done by the field's change": cumulative_simpson(np.sum(moment * b_rate, axis=1), x=times, initial=0.0),
        "done by the gravity gradient": -cumulative_simpson(np.sum(w * pull, axis=1), x=times, initial=0.0),
        "heat of the rods": np.asarray(motion.rod_heat).sum(axis=1),
    }
    return {name: x - x[0] for name, x in entries.items()}


def draw(motion: Trajectory, times: np.ndarray, path: Path) -> None:
    """Spin and heat over three days."""
    subtitle = "1U with a magnet of 0.06 A m² and two rods, 500 km; synthetic"
    figure = new_figure(7.6, 5.4, "What two hysteresis rods take from a tumbling satellite", subtitle)
    above, below = figure.subplots(2, 1, sharex=True)
    figure.subplots_adjust(left=0.12, right=0.97, top=0.87, bottom=0.1, hspace=0.12)
    above.semilogy(times / HOUR, np.rad2deg(np.linalg.norm(motion.angular_velocity, axis=1)), lw=0.4, color=INK)
    above.yaxis.set_minor_formatter("{x:g}")
    above.yaxis.set_major_formatter("{x:g}")
    orbits = np.arange(0, times[-1] / PERIOD, 1.0)
    heat = np.interp(orbits * PERIOD, times, np.asarray(motion.rod_heat).sum(axis=1))
    below.step(orbits[1:] * PERIOD / HOUR, 1e6 * np.diff(heat), where="pre", color=LEFT_OUT)
    below.set_yscale("log")
    dress(above, y_label="spin, deg/s")
    above.tick_params(which="minor", labelsize=8)
    dress(below, y_label="heat, µJ an orbit", x_label="time since release, h")
    path.write_bytes(png_bytes(figure))


def main() -> None:
    """Print and write all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a hundredth of the cases")
    parser.add_argument("--out", type=Path, default=Path())
    options = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)
    figures = {}

    one = jax.tree.map(lambda leaf: leaf[0], states(1, 1))
    times = np.arange(60.0, 3 * DAY + 1.0, 60.0)
    for tolerance in (1e-3, 1e-6):
        motion, seconds = timed(lambda tolerance=tolerance: simulate(CRAFT, one, AROUND, times, tolerance=tolerance))
        figures[f"3 days, one, {tolerance:g} rad"] = {**seconds, "error_rad": motion.error}
        print(figures, flush=True)
    draw(motion, times, options.out / "hysteresis.png")

    fine = np.arange(0.0, 2 * PERIOD, 0.5)
    entries = book(simulate(CRAFT, one, AROUND, fine, tolerance=1e-7), fine)
    rest = sum(entries.values())
    figures["energy book over two orbits, J"] = {name: float(x[-1]) for name, x in entries.items()}
    figures["energy book, largest gap over the heat"] = float(np.abs(rest).max() / entries["heat of the rods"][-1])
    print(figures, flush=True)

    scale = 100 if options.quick else 1
    for cases, hours, tolerance in ((64, 2.0, 1e-3), (64, 2.0, 1e-6), (1000 // scale, 12.0, 1e-3)):
        start, at = states(cases, 3), np.linspace(600.0, hours * HOUR, 12)
        motion, seconds = timed(
            lambda start=start, at=at, tolerance=tolerance: simulate_many(CRAFT, start, AROUND, at, tolerance=tolerance)
        )
        name = f"{cases} cases, {hours:g} h, {tolerance:g} rad"
        figures[name] = {**seconds, "error_rad": motion.error, "chaotic": len(motion.unresolved)}
        print(name, figures[name], flush=True)
    figures["peak memory, MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000
    (options.out / "hysteresis.json").write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
