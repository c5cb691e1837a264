"""The fit against SciPy's least squares with finite differences on the same residual, written apart in NumPy.

A: from beside the minimum, 17 unknowns (state, magnet, rods, inertia), bundled session. B: the same unknowns over the
whole session from random starts: how many reach the best minimum. Prints tables with ratios, writes JSON.

    .venv/bin/python experiments/benchmarks/fit_peers.py --out fit-peers.json (numba: pip install -e '.[benchmarks]')
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np
from models import fit_peer_model, fit_peer_numba
from models.attitude_job import timed
from scipy.optimize import least_squares

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.measurements.floor import NO_FLOOR
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import free_parameters
from fitting.solvers.descent import adam, lbfgs
from fitting.solvers.refine import PLAIN
from fitting.starts.conventions import Convention
from fitting.starts.growing import Run, arcs, grow
from fitting.starts.ladder import directed_samples, first_guesses
from fitting.starts.multi_start import Stage, Starts, _settings, advance, solve
from fitting.starts.sights import sights_of
from fitting.surroundings import surroundings
from jaxsat.bundled import BUNDLED
from jaxsat.integrators import RK4, step_for
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

MAGNET, RODS = ("magnet.x", "magnet.y", "magnet.z"), ("rods.y", "rods.z")
INERTIA = tuple(f"inertia.{entry}" for entry in ("xx", "yy", "zz", "xy", "xz", "yz"))
FINE_STEP = 16.0
"""Integration step of part A [s]."""
TURN, RATE_OFF = np.radians([2.0, -1.5, 1.0]), np.array([3e-3, -2e-3, 2e-3])
"""Distance of part A's start from the truth [rad], [rad/min]; the parameters start at the nominal satellite."""
MAX_RATE = np.radians(1.5)
COARSE_TOLERANCE = 4e-2
"""Integration error over the session allowed in part B [rad]."""
SAME = 0.5
"""Costs that differ by less are the same minimum: chi2 differs by less than one."""
ITERATIONS = {"LM": 30, "L-BFGS": 500, "Adam": 3000}
MAX_EVALUATIONS = 100
"""Over the whole session from one start of part B."""


class Job:
    """Session, unknowns and starts, for us and in NumPy arrays for the peers."""

    def __init__(self, max_step: float):
        truth = json.loads(BUNDLED.with_suffix(".truth.json").read_text())
        cfg = truth["cfg"]
        known = {"spacecraft.imax_mA": cfg["imax"], "albedo.specular": cfg["albedo_specular"]}
        satellite = read_satellite(changed=known)
        session = read_telemetry(BUNDLED, satellite)
        cells = session.channels["cells"]
        self.samples = samples = Samples.of({"cells": cells}, session.epoch, {})
        around, _ = surroundings(satellite, session)
        problem = build_problem(samples, satellite.model, around, delayed=(), max_step=max_step, room_for=max_step)
        self.problem = problem = replace(problem, floor=np.full(problem.floor.shape, NO_FLOOR))
        free = chosen_leaves(satellite.leaves, ["magnet", "rods", "inertia"])
        self.parameters = parameters = free_parameters(satellite.model, satellite.leaves, free, held=satellite.held)
        self.moves = parameters.everything
        self.weight = usable(problem, samples)
        self.last = len(samples.t) - 1
        state = np.concatenate([TURN, np.array(truth["w"][0]) / RATE_UNIT + RATE_OFF])
        self.x = np.pad(state, (0, len(self.moves) - len(state)))
        self.reference = np.array(truth["q"][0])

        light, n = problem.sky.light, len(samples.t)
        assert light is not None
        self.tables = fit_peer_model.Tables(
            step=np.asarray(problem.grid.step),
            position=np.asarray(problem.orbit.position_eci),
            field=np.asarray(problem.orbit.b_field_eci),
            sample_state=np.asarray(problem.grid.sample_index)[:n],
            sun=np.asarray(light.sun_eci)[:n],
            illumination=np.asarray(light.illumination)[:n],
            mirror_direction=np.asarray(light.specular_direction_eci)[:n],
            mirror_factor=np.asarray(light.specular_factor)[:n],
            patch_direction=np.asarray(light.diffuse_direction_eci)[:n],
            patch_weight=np.asarray(light.diffuse_weight)[:n],
            measured=np.asarray(problem.measured["cells"])[:n],
            used=self.weight[:n, 0] > 0,
            noise=cells.sigma,
        )
        names = [leaf.name for leaf in satellite.leaves]
        value = dict(zip(names, np.asarray(parameters.tree.nominal), strict=True))
        sigma = {leaf.name: leaf.sigma for leaf in satellite.leaves}
        self.satellite = fit_peer_model.Satellite(
            magnet=np.array([value[name] for name in MAGNET]),
            rods=np.array([value[name] for name in RODS]),
            inertia=np.array([value[name] for name in INERTIA]),
            sigma=np.array([sigma[name] for name in MAGNET + RODS + INERTIA], dtype=float),
            rods_field=3.0e-5,
            max_current=float(value["imax"]),
            specular=float(value["albedo.specular"]),
            diffuse=float(value["albedo.diffuse"]),
        )
        # The peers count their unknowns in this order, ours in that of the satellite file, padding between.
        places = [parameters.names.index(name) for name in MAGNET + RODS + INERTIA]
        self.places = np.array([*range(6), *places])

    def of_peers(self, x: np.ndarray) -> np.ndarray:
        """Our unknowns in the order of the peers."""
        return x[..., self.places]

    def stage(self, iterations: int) -> Stage:
        """The whole session, plain least squares, everything free."""
        return Stage(self.last, 10**9, iterations, PLAIN, self.moves)

    def peer(self, propagate: fit_peer_model.Propagate, reference: np.ndarray) -> fit_peer_model.Model:
        """The model of the peers about an attitude."""
        return fit_peer_model.Model(self.tables, self.satellite, reference, propagate)


def local(job: Job) -> list[dict]:
    """Part A: a row each for time, evaluations and cost at the end."""
    bounds, start = job.parameters.bounds(), job.of_peers(job.x)
    limits = tuple(job.of_peers(bound) for bound in bounds)
    runs: list[tuple[str, Callable[[], Any], Callable[[Any], float], int]] = []
    chunk = (job.problem, job.parameters, job.stage(ITERATIONS["LM"]), job.x[None], job.reference[None], job.weight)
    solve(*chunk)
    runs.append(("ours, LM", lambda: solve(*chunk), lambda p: float(p.cost[0]), 5))
    for name, solver, repeats in (("L-BFGS", lbfgs, 2), ("Adam", adam, 1)):
        jitted: Any = eqx.filter_jit(solver)
        settings = _settings(job.problem, job.stage(ITERATIONS[name]))
        inputs = (job.problem, job.parameters.tree, settings, bounds, job.x, job.reference, job.weight)
        call = partial(jitted.lower(*inputs).compile(), *inputs)
        run = lambda call=call: jax.block_until_ready(call())  # noqa: E731
        runs.append((f"ours, {name}", run, lambda p: float(p.cost), repeats))

    numpy = job.peer(fit_peer_model.propagate, job.reference)
    compiled_peer = job.peer(fit_peer_numba.propagate, job.reference)
    compiled_peer.residual(start)
    for name, model, repeats, options in (
        ("SciPy LM, NumPy, columns one by one", numpy, 1, {"method": "lm", "jac": "2-point"}),
        ("SciPy LM, NumPy, columns at once", numpy, 1, {"method": "lm", "jac": numpy.jacobian}),
        ("SciPy TRF, NumPy, columns at once", numpy, 1, {"method": "trf", "jac": numpy.jacobian, "bounds": limits}),
        ("SciPy LM, numba, column after column", compiled_peer, 5, {"method": "lm", "jac": compiled_peer.jacobian}),
    ):
        fit = partial(least_squares, model.residual, start, **options)
        runs.append((name, fit, lambda found: float(found.cost), repeats))

    rows = []
    for name, call, cost, repeats in runs:
        found: list[Any] = []
        timing = timed(lambda call=call, found=found: found.append(call()), repeats=repeats)
        reached = cost(found[-1])
        rows.append({"name": name, "best_s": timing.best, "cpu_s": timing.cpu, "cost": reached})
        print(f"  {name}: {timing.best:.3f} s", flush=True)
    least = min(row["cost"] for row in rows)
    for row in rows:
        row["over_ours"] = row["best_s"] / rows[0]["best_s"]
        row["cpu_over_ours"] = row["cpu_s"] / rows[0]["cpu_s"]
        row["cost_above_least"] = row["cost"] / least - 1.0
    return rows


def blind(job: Job, count: int, numpy_count: int) -> list[dict]:
    """Part B: from the same starts, how many reach the least cost that any of them found, and the time of all."""
    sights = sights_of(job.problem, job.samples)
    guesses = first_guesses(sights, 0, count, MAX_RATE, np.random.default_rng(0))
    starts = guesses.starts(np.zeros(len(job.moves)))
    seen = directed_samples(sights)
    schedule = arcs(seen, job.last, job.parameters)
    common = (job.problem, job.parameters)

    def finished(grown: Starts, iterations: int = 30) -> np.ndarray:
        return advance(*common, job.stage(iterations), grown, job.weight).cost

    def each_start_grown():
        grown = starts
        for stage in schedule:
            grown = advance(*common, stage, grown, job.weight)
        return finished(grown)

    def grown_as_fitted():
        runs = [Run(Convention({}, 0.0), job.problem, starts)]
        grow(runs, seen, job.last, job.parameters, job.weight)
        survivors = runs[0].starts
        return finished(survivors.take(np.arange(min(8, len(survivors.cost)))))

    def scipy(propagate, number):
        costs = []
        for k in range(number):
            model = job.peer(propagate, starts.reference[k])
            options = {"method": "lm", "jac": model.jacobian, "max_nfev": MAX_EVALUATIONS}
            costs.append(least_squares(model.residual, job.of_peers(starts.x[k]), **options).cost)
        return np.array(costs)

    runs: list[tuple[str, Callable[[], np.ndarray], int]] = [
        ("ours, growing arcs, worse starts dropped on the way", grown_as_fitted, 2),
        ("ours, growing arcs, every start to the end", each_start_grown, 1),
        ("ours, LM over the whole session", lambda: finished(starts, MAX_EVALUATIONS), 1),
        ("SciPy LM over the whole session, numba", lambda: scipy(fit_peer_numba.propagate, count), 1),
        ("SciPy LM over the whole session, NumPy", lambda: scipy(fit_peer_model.propagate, numpy_count), 1),
    ]
    rows = []
    for name, call, repeats in runs:
        found: list[np.ndarray] = []
        timing = timed(lambda call=call, found=found: found.append(call()), repeats=repeats)
        rows.append({"name": name, "best_s": timing.best, "cpu_s": timing.cpu, "costs": found[-1].tolist()})
        print(f"  {name}: {timing.best:.2f} s", flush=True)
    least = min(min(row["costs"]) for row in rows)
    for row in rows:
        costs = row.pop("costs")
        row |= {"least_cost": min(costs), "found": min(costs) < least + SAME}
        row["reached"] = int(np.sum(np.array(costs) < least + SAME))
        row["of"] = numpy_count if "NumPy" in row["name"] else count
        row["best_s_each_start"] = row["best_s"] / row["of"]
    # Survivors are few and differ from each other by construction: a share of them says nothing.
    rows[0]["reached"] = None
    return rows


def table(head: list[str], rows: list[list[str]]) -> str:
    """Markdown."""
    lines = ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("fit-peers.json"))
    parser.add_argument("--starts", type=int, default=64, help="random starts of part B")
    parser.add_argument("--numpy-starts", type=int, default=8, help="how many of them SciPy on NumPy has to do")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)

    print("A: from beside the minimum, 17 unknowns, 71 samples", flush=True)
    near = local(Job(FINE_STEP))
    print(
        table(
            ["", "best, s", "over ours, LM", "processor, s", "over ours, LM", "cost over the least - 1"],
            [
                [
                    r["name"], f"{r['best_s']:.3f}", f"{r['over_ours']:.1f}", f"{r['cpu_s']:.3f}",
                    f"{r['cpu_over_ours']:.1f}", f"{r['cost_above_least']:.0e}",
                ]
                for r in near
            ],
        )
    )  # fmt: skip
    duration = 4500.0
    job = Job(step_for(RK4, MAX_RATE, duration, COARSE_TOLERANCE))
    print(f"\nB: {arguments.starts} random starts, whole session, {job.tables.sample_state[-1]} steps", flush=True)
    far = blind(job, arguments.starts, arguments.numpy_starts)
    print(
        table(
            ["", "reach the best", "found it", "best, s", "each start, s", "processor, s"],
            [
                [
                    r["name"], "" if r["reached"] is None else f"{r['reached']} of {r['of']}",
                    "yes" if r["found"] else "no", f"{r['best_s']:.1f}", f"{r['best_s_each_start']:.3f}",
                    f"{r['cpu_s']:.1f}",
                ]
                for r in far
            ],
        )
    )  # fmt: skip
    arguments.out.write_text(json.dumps({"local": near, "blind": far}, indent=1))


if __name__ == "__main__":
    main()
