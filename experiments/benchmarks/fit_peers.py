"""The fit against SciPy's least squares with finite differences on the same residual, written apart in NumPy.

A: from beside the minimum, 17 unknowns (state, magnet, rods, inertia), bundled session. B: the same unknowns over the
whole session from random starts: how many reach the best minimum. Prints tables with ratios, writes JSON.

    .venv/bin/python experiments/benchmarks/fit_peers.py --out fit-peers.json (numba: pip install -e '.[benchmarks]')
"""

import argparse
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from models import fit_peer_model, fit_peer_numba
from models.attitude_job import timed
from scipy.optimize import least_squares

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import build_problem
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.descent import adam, lbfgs
from fitting.solvers.least_squares import levenberg_marquardt
from fitting.solvers.refine import PLAIN
from fitting.starts.first_guesses import random_starts
from fitting.starts.multi_start import Stage, Starts, _settings, advance, grow, solve
from fitting.starts.schedule import arc_schedule
from jaxsat.bundled import BUNDLED
from jaxsat.integrators import RK4, step_for
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

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
        satellite, settings = read_satellite(changed=known), FitSettings(free="magnet,rods,inertia")
        data = prepare_session(read_telemetry(BUNDLED, satellite)).observations()
        noise = 1e-3 * settings.reading_sigma_mA
        self.problem = problem = build_problem(data, noise=noise, max_step=max_step)
        self.parameters = parameters = parametrization(
            nominal_model(satellite), settings.free_names, settings.prior_sigma
        )
        self.lit, agree = problem.bright() & problem.sunlit(), problem.bright() == problem.sunlit()
        self.weight = np.repeat((np.asarray(problem.valid) & agree).astype(float)[:, None], 6, axis=1)
        self.last = len(data.t) - 1
        self.x = np.zeros(17)
        self.x[:6] = np.concatenate([TURN, np.array(truth["w"][0]) / RATE_UNIT + RATE_OFF])
        self.reference = np.array(truth["q"][0])

        light, n = problem.light, len(data.t)
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
            measured=np.asarray(problem.measured)[:n],
            used=self.weight[:n, 0] > 0,
            noise=noise,
        )
        value = np.asarray(parameters.nominal)
        self.satellite = fit_peer_model.Satellite(
            magnet=value[0:3],
            rods=value[3:5],
            inertia=value[5:11],
            sigma=np.asarray(parameters.scale)[:11],
            rods_field=float(parameters.reference_field),
            max_current=float(value[11]),
            specular=float(value[18]),
            diffuse=float(value[19]),
        )

    def stage(self, iterations: int) -> Stage:
        """The whole session, plain least squares, everything free."""
        return Stage(self.last, 10**9, iterations, PLAIN, np.ones(17, bool))

    def peer(self, propagate: fit_peer_model.Propagate, reference: np.ndarray) -> fit_peer_model.Model:
        """The model of the peers about an attitude."""
        return fit_peer_model.Model(self.tables, self.satellite, reference, propagate)


def local(job: Job) -> list[dict]:
    """Part A: a row each for time, evaluations and cost at the end."""
    bounds = job.parameters.bounds()
    runs: list[tuple[str, Callable[[], Any], Callable[[Any], float], int]] = []
    chunk = (job.problem, job.parameters, job.stage(ITERATIONS["LM"]), job.x[None], job.reference[None], job.weight)
    solve(*chunk)
    runs.append(("ours, LM, as `fit` calls it", lambda: solve(*chunk), lambda p: float(p.cost[0]), 5))
    for name, solver, repeats in (("LM", levenberg_marquardt, 5), ("L-BFGS", lbfgs, 2), ("Adam", adam, 1)):
        # One start alone, where `fit` has chunks of several.
        jitted: Any = eqx.filter_jit(solver)
        settings = _settings(job.problem, job.stage(ITERATIONS[name]))
        inputs = (job.problem, job.parameters, settings, bounds, job.x, job.reference, job.weight)
        call = partial(jitted.lower(*inputs).compile(), *inputs)
        run = lambda call=call: jax.block_until_ready(call())  # noqa: E731
        runs.append((f"ours, {name}, one start alone", run, lambda p: float(p.cost), repeats))

    numpy = job.peer(fit_peer_model.propagate, job.reference)
    compiled_peer = job.peer(fit_peer_numba.propagate, job.reference)
    compiled_peer.residual(job.x)
    for name, model, repeats, options in (
        ("SciPy LM, NumPy, columns one by one", numpy, 1, {"method": "lm", "jac": "2-point"}),
        ("SciPy LM, NumPy, columns at once", numpy, 1, {"method": "lm", "jac": numpy.jacobian}),
        ("SciPy TRF, NumPy, columns at once", numpy, 1, {"method": "trf", "jac": numpy.jacobian, "bounds": bounds}),
        ("SciPy LM, numba, column after column", compiled_peer, 5, {"method": "lm", "jac": compiled_peer.jacobian}),
    ):
        fit = partial(least_squares, model.residual, job.x, **options)
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
        row["over_ours"] = row["best_s"] / rows[1]["best_s"]
        row["cpu_over_ours"] = row["cpu_s"] / rows[1]["cpu_s"]
        row["cost_above_least"] = row["cost"] / least - 1.0
    return rows


def blind(job: Job, count: int, numpy_count: int) -> list[dict]:
    """Part B: from the same starts, how many reach the least cost that any of them found, and the time of all."""
    first = int(np.flatnonzero(job.lit)[0])
    measured, sun = jnp.asarray(job.problem.measured), jnp.asarray(job.problem.light.sun_eci)
    q, rate = random_starts(jax.random.key(0), count, measured[first], sun[first], jnp.asarray(MAX_RATE))
    x = np.zeros((count, 17))
    x[:, 3:6] = np.asarray(rate) / RATE_UNIT
    starts = Starts(x, np.asarray(q), np.zeros(count))
    schedule = arc_schedule(job.lit[: job.last + 1], job.last, job.parameters.free)
    common = (job.problem, job.parameters)

    def finished(grown: Starts, iterations: int = 30) -> np.ndarray:
        return advance(*common, job.stage(iterations), grown, job.weight).cost

    def each_start_grown():
        grown = starts
        for stage in schedule:
            grown = advance(*common, stage, grown, job.weight)
        return finished(grown)

    def grown_as_fitted():
        survivors = grow(*common, schedule, starts, job.weight, lambda *_: None)
        return finished(survivors.take(np.arange(min(8, len(survivors.cost)))))

    def scipy(propagate, number):
        costs = []
        for k in range(number):
            model = job.peer(propagate, starts.reference[k])
            options = {"method": "lm", "jac": model.jacobian, "max_nfev": MAX_EVALUATIONS}
            costs.append(least_squares(model.residual, x[k], **options).cost)
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
            ["", "best, s", "over ours, LM alone", "processor, s", "over ours, LM alone", "cost over the least - 1"],
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
