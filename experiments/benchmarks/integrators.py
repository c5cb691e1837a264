"""Speed of the attitude integrators against heyoka and numba, in one run: ratios, not seconds, are what to trust.

.venv/bin/pip install -e '.[benchmarks]'
.venv/bin/python experiments/benchmarks/integrators.py --out integrators.json
"""

import argparse
import json
import os
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from models import peers_heyoka, peers_numba
from models.attitude_job import (
    DIPOLE,
    EARTH_RADIUS,
    EARTH_RATE,
    GREENWICH_ANGLE,
    HARDEST,
    INCLINATION,
    LATITUDE_ARGUMENT,
    NODE,
    Array,
    Job,
    Peer,
    Timing,
    along_sphere,
    measure,
    print_header,
    reference,
    reference_jacobian,
    timed,
    worst_error,
)

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import InternalField, KeplerOrbit, igrf_field
from jaxsat.environment.surroundings import Surroundings
from jaxsat.integrators import AdamsGrid
from jaxsat.math.one_function import compiled
from jaxsat.simulate import Sensitivities, simulate, simulate_many, simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import GravityGradient, PermanentMagnet

jax.config.update("jax_enable_x64", True)

CHECKED = [*range(32), *HARDEST]
TORQUES = (GravityGradient(), PermanentMagnet())
STEP = 3.75
"""Of the 10 000 cases [s]; the longest that divides the arc with the worst error below 1e-6."""
SENSITIVITY_STEP = 4.5
BATCHED = 512
"""Trajectories whose sensitivities are taken at once."""


def surroundings(job: Job) -> Surroundings:
    """Orbit and dipole of the job, as the simulator has them."""
    orbit = KeplerOrbit(job.radius, 0.0, INCLINATION, NODE, 0.0, LATITUDE_ARGUMENT, job.mu)
    g11, h11, g10 = DIPOLE
    g, h = np.array([[0.0, 0.0], [g10, g11]]), np.array([[0.0, 0.0], [0.0, h11]])
    return Surroundings(orbit, InternalField(jnp.asarray(g), jnp.asarray(h), EARTH_RADIUS), GREENWICH_ANGLE, EARTH_RATE)


def spacecraft(inertia: Any, magnet: Any) -> Spacecraft:
    """The job's satellite: a magnet and no rods."""
    dtype = jnp.asarray(inertia).dtype
    rods = MagneticRods(jnp.zeros(0, dtype), jnp.zeros((0, 3), dtype), jnp.array(3.0e-5, dtype))
    panels = SolarPanels(box_normals().astype(dtype), jnp.array(0.24, dtype), jnp.ones(6, dtype))
    return Spacecraft(jnp.asarray(inertia), jnp.asarray(magnet), rods, panels)


def states(job: Job, dtype: Any = float) -> AttitudeState:
    """Initial states of all cases."""
    return AttitudeState(jnp.asarray(job.quaternions, dtype), jnp.asarray(job.rates, dtype))


def in_dtype(tree: Any, dtype: Any) -> Any:
    """Arrays of a tree in another precision."""
    return jax.tree.map(lambda x: x.astype(dtype) if eqx.is_inexact_array(x) else x, tree)


def many(job: Job, name: str, *, dtype: Any = float, **options: Any) -> Peer:
    """The job by `simulate_many`, everything included that a user's call includes."""
    craft, start = in_dtype(spacecraft(job.inertia, job.magnet), dtype), states(job, dtype)
    around = in_dtype(surroundings(job), dtype)
    times = np.array([job.duration])

    def run():
        motion = simulate_many(craft, start, around, times, torques=TORQUES, **options)
        return np.concatenate([motion.quaternion[:, -1], motion.angular_velocity[:, -1]], axis=1)

    began = time.perf_counter()
    run()
    return Peer(f"jaxsat {name}", time.perf_counter() - began, run, lambda found: found)


def made(program: Callable, *arguments: Any) -> tuple[Callable, float]:
    """A compiled program of the arguments, or of others like them, and the seconds until it has run once."""
    began = time.perf_counter()
    jax.block_until_ready(program(*arguments))
    seconds = time.perf_counter() - began
    return lambda *others: jax.block_until_ready(program(*(others or arguments))), seconds


def sensitivities(job: Job, name: str, count: int) -> Peer:
    """Derivatives (cases, 7, 13) of the final (q, w) with respect to the job's unknowns, by forward mode."""
    moments, axes = job.principal
    nominal = spacecraft(job.inertia, job.magnet)

    def satellite(x):
        inertia = axes @ jnp.diag(x[10:]) @ axes.T
        return eqx.tree_at(lambda c: (c.inertia, c.magnet), nominal, (inertia, x[7:10])), AttitudeState(x[:4], x[4:7])

    of_all = np.broadcast_to(np.concatenate([job.magnet, moments]), (count, 6))
    unknowns = np.concatenate([job.quaternions[:count], job.rates[:count], of_all], axis=1)
    unknowns = unknowns[0] if count == 1 else unknowns
    began = time.perf_counter()
    program = Sensitivities(
        satellite, surroundings(job), np.array([job.duration]), torques=TORQUES, max_step=SENSITIVITY_STEP
    )

    def run():
        found = program(unknowns)
        return np.concatenate([found.quaternion, found.angular_velocity], axis=-2).reshape(-1, 7, 13)

    run()
    seconds = time.perf_counter() - began
    return Peer(f"jaxsat {name}", seconds, run, lambda found: along_sphere(found, job.quaternions[: len(found), None]))


def single(job: Job) -> dict[str, float]:
    """One trajectory at 1e-6: steps found by `simulate`, then the grid alone; and the cost of a gradient."""
    craft, around, times = spacecraft(job.inertia, job.magnet), surroundings(job), np.array([job.duration])
    start = AttitudeState(jnp.asarray(job.quaternions[0]), jnp.asarray(job.rates[0]))
    truth = reference(job, [0])[:, :4]
    motion = simulate(craft, start, around, times, torques=TORQUES)
    grid = motion.grid
    assert grid is not None
    table = eqx.filter_jit(around)(jnp.asarray(grid.node_times))

    def quaternion(start, craft, table):
        return simulate_on_grid(craft, start, table, grid, torques=TORQUES).quaternion

    forward, compile_s = made(compiled(quaternion), start, craft, table)
    whole, _ = made(compiled(lambda start, craft: quaternion(start, craft, around(grid.node_times))), start, craft)

    def loss(unknowns):
        start, craft = unknowns
        return jnp.sum(quaternion(start, craft, table)[-1] * jnp.arange(4.0))

    reverse, reverse_compile_s = made(compiled(jax.grad(loss)), (start, craft))
    times_s = {name: timed(run, repeats=30) for name, run in (("f", forward), ("w", whole), ("r", reverse))}
    return {
        "error_claimed_rad": float(motion.error or np.nan),
        "error_q": worst_error(np.asarray(motion.quaternion), truth),
        "step_s": float(grid.step),
        "compile_s": compile_s,
        "run_ms": 1e3 * times_s["f"].best,
        "run_median_ms": 1e3 * times_s["f"].median,
        "with_table_ms": 1e3 * times_s["w"].best,
        "gradient_compile_s": reverse_compile_s,
        "gradient_ms": 1e3 * times_s["r"].best,
        "gradient_over_forward": times_s["r"].best / times_s["f"].best,
    }


def igrf_along_nodes(job: Job) -> dict[str, float]:
    """IGRF of degree 13 in inertial axes along 2000 nodes of an orbit, the orbit included."""
    around = eqx.tree_at(lambda s: s.field, surroundings(job), igrf_field(2025.5))
    run, seconds = made(jax.jit(lambda t: around(t)), jnp.linspace(0.0, job.duration, 2000))
    timing = timed(run, repeats=50)
    return {"compile_s": seconds, "run_ms": 1e3 * timing.best, "run_median_ms": 1e3 * timing.median}


def long_arc(job: Job) -> dict[str, float]:
    """Ten days of one satellite read every minute, and the memory that it took."""
    craft, around = spacecraft(job.inertia, job.magnet), surroundings(job)
    start = AttitudeState(jnp.asarray(job.quaternions[0]), jnp.asarray(job.rates[0]))
    times = np.arange(60.0, 864000.1, 60.0)
    before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    grid = AdamsGrid.through(times, start=0.0, max_step=3.0)

    @jax.jit
    def run(start, craft):
        return simulate_on_grid(craft, start, around(jnp.asarray(grid.node_times)), grid, torques=TORQUES).quaternion

    found = np.asarray(run(start, craft))
    seconds = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"seconds": seconds, "samples": len(found), "more_memory_MB": (after - before) / 1024}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("integrators.json"))
    arguments = parser.parse_args()
    job = Job()
    truth = reference(job, CHECKED)
    rows: dict[str, dict[str, float]] = {}

    def row(key: str, peer: Peer, error: Callable, repeats: int = 7) -> None:
        timing, achieved = measure(peer, error, repeats=repeats)
        rows[key] = {**_seconds(timing), "compile_s": peer.compile_s, "error": achieved}

    def error(found: Array) -> float:
        return worst_error(found[CHECKED, :4], truth[:, :4])

    print_header("worst q")
    row("jaxsat", many(job, f"simulate_many, steps of {STEP:g} s", max_step=STEP), error)
    row("jaxsat_tolerance", many(job, "simulate_many, tolerance 1e-6, pilot included", tolerance=1e-6), error)
    row("heyoka_library", peers_heyoka.job_peer(job, form="inertial", tolerance=1e-10, batch=8, library=True), error)
    tuned: dict[str, Any] = {"fast_math": True, "force_avx512": True}
    row("heyoka_tuned", peers_heyoka.job_peer(job, tolerance=1e-10, batch=8, **tuned), error)
    row("numba_rk4", peers_numba.runge_kutta_peer(job, 4, 0.225), error)
    row("numba_rk8", peers_numba.runge_kutta_peer(job, 8, 9.0), error)
    row("jaxsat_again", many(job, f"simulate_many, steps of {STEP:g} s", max_step=STEP), error)
    row(
        "jaxsat_f32",
        many(job, f"the same in float32, steps of {STEP:g} s", dtype=jnp.float32, max_step=STEP, tolerance=0.1),
        error,
    )
    best = min(rows["jaxsat"]["best_s"], rows["jaxsat_again"]["best_s"])
    ratios = {key: rows[key]["best_s"] / best for key in rows if not key.startswith("jaxsat")}
    print("times of the others over jaxsat's:", {key: round(value, 2) for key, value in ratios.items()})

    jacobian = reference_jacobian(job, 0)

    def column_error(found: Array) -> float:
        return float((np.abs(found[0] - jacobian).max(axis=0) / np.abs(jacobian).max(axis=0)).max())

    print_header("column")
    some, one = Job(cases=BATCHED), Job(cases=1)
    row("sensitivities", sensitivities(some, f"7 x 13 of {BATCHED}", BATCHED), column_error, 5)
    row("sensitivities_single", sensitivities(one, "7 x 13 of one", 1), column_error, 15)
    options: dict[str, Any] = {"tolerance": 1e-7, "fast_math": True, "force_avx512": True}
    heyoka = peers_heyoka.sensitivity_peer(some, batch=8, **options)
    row("heyoka_sensitivities", heyoka, column_error, 5)
    row(
        "heyoka_sensitivities_single",
        peers_heyoka.sensitivity_peer(one, batch=1, threads=1, **options),
        column_error,
        15,
    )

    result = {
        "cores": os.cpu_count(),
        "job": rows,
        "ratios": ratios,
        "sensitivity_ms_each": 1e3 * rows["sensitivities"]["best_s"] / BATCHED,
        "heyoka_sensitivity_ms_each": 1e3 * rows["heyoka_sensitivities"]["best_s"] / BATCHED,
        "single": single(job),
        "igrf_2000_nodes": igrf_along_nodes(job),
        "ten_days": long_arc(job),
    }
    print(json.dumps({key: value for key, value in result.items() if key != "job"}, indent=1))
    arguments.out.write_text(json.dumps(result, indent=1))


def _seconds(timing: Timing) -> dict[str, float]:
    return {"best_s": timing.best, "median_s": timing.median, "cpu_s": timing.cpu}


if __name__ == "__main__":
    main()
