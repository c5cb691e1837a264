"""One point of `growth.py` in a process of its own: the work of one size, its time and the memory that it took.

`python growth_points.py NAME SIZE` prints a line of JSON. What a point needs is made first; then the work is done once,
which compiles, and its peak is the process's high-water mark (`VmHWM` of Linux, reset before) over what stood before;
then again, timed.
"""

import gc
import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from integrators import TORQUES, spacecraft, states, surroundings
from models.attitude_job import Job

from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import free_parameters
from fitting.solvers.refine import PLAIN
from fitting.starts.multi_start import Stage, solve
from fitting.surroundings import surroundings as session_surroundings
from jaxsat import compiled
from jaxsat.dynamics import AttitudeState
from jaxsat.integrators import RK4, AdamsGrid, step_for
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.simulate import simulate_many, simulate_on_grid
from jaxsat.synthetic.twins.settings import TwinSettings
from jaxsat.synthetic.twins.table import table_text
from jaxsat.synthetic.twins.twin import Twin, make_twin
from jaxsat.telemetry import TableSession, read_telemetry

jax.config.update("jax_enable_x64", True)

STEP, ARC = 3.6, 900.0
"""Of `simulate_many`, and the arc of its cases [s]."""
READ = 100
"""Samples of an arc, however long."""
SENSITIVE_STEP, SENSITIVE_ARC = 4.5, 4500.0
ITERATIONS, OFF, FINISHED = 15, 1e-3, 1e-4
"""Steps of the local fit at most; how far off it begins in attitude, and over the arc in rate [rad]; and what
another step may promise to save at its end."""
SATELLITE = """name = "day"

[body]
size_m = [0.1, 0.1, 0.34]
inertia_kg_m2 = {value = [0.035, 0.034, 0.007], sigma = [0.0007, 0.0007, 0.00014]}

[magnet]
dipole_A_m2 = {value = [0.0, 0.0, 0.0], sigma = 0.001}

[orbit]                                 # over the terminator: always in the Sun
elements = {a_km = 6878.137, e = 0.0, i_deg = 97.4, raan_deg = 90.0, argp_deg = 0.0, mean_anomaly_deg = 0.0, \
epoch = "2026-03-20T12:00:00Z"}

[time]
column = "utc"

[sensors.mag]
kind = "magnetometer"
unit = "uT"
bias = {value = [0.0, 0.0, 0.0], sigma = 0.2}

[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100.0

[sensors.gyro]
kind = "gyro"
unit = "deg/s"
bias = {value = [0.0, 0.0, 0.0], sigma = 0.02}

[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.02

[sensors.sun]
kind = "sun_vector"

[channels.sun]
columns = ["sx", "sy", "sz"]
unit = "1"
sigma = 0.005
"""
RATE_DEG_S = (1.5, 0.05, -0.1)
"""About the axis of most inertia: a day of a tumble would be chaotic, and no fit of it possible."""
Work = Callable[[], object]


def cases(size: int) -> Work:
    """`simulate_many` over 900 s, the last state alone."""
    job = Job(cases=size)
    craft, start, around = spacecraft(job.inertia, job.magnet), states(job), surroundings(job)
    return lambda: simulate_many(craft, start, around, np.array([ARC]), torques=TORQUES, max_step=STEP).quaternion


def arc(size: int) -> Work:
    """`simulate_many` of one satellite over so many hours, the last state alone."""
    return _over(1, np.array([3600.0 * size]))


def read(size: int) -> Work:
    """`simulate_many` of 16 satellites over so many hours, each read a hundred times."""
    return _over(16, np.linspace(0.0, 3600.0 * size, READ + 1)[1:])


def _over(count: int, times: np.ndarray) -> Work:
    job = Job(cases=count)
    craft, start, around = spacecraft(job.inertia, job.magnet), states(job), surroundings(job)
    return lambda: simulate_many(craft, start, around, times, torques=TORQUES, max_step=STEP).quaternion


def free(size: int) -> Work:
    """The Jacobian of 75 attitudes by so many unknowns: columns of a tangent matrix, as a fit has them."""
    job = Job(cases=1)
    grid = AdamsGrid.through(np.linspace(0.0, SENSITIVE_ARC, 76)[1:], start=0.0, max_step=SENSITIVE_STEP)
    table = surroundings(job)(jnp.asarray(grid.node_times))
    base = jnp.asarray(np.concatenate([job.quaternions[0], job.rates[0], job.magnet, np.diag(job.inertia)]))
    scale = np.concatenate([np.ones(4), np.full(3, 1e-2), np.full(3, 0.3), np.full(3, 0.05)])
    tangent = scale[:, None] * np.random.default_rng(0).normal(size=(len(scale), size))

    def quaternion(x):
        values = base + tangent @ x
        inertia = jnp.asarray(job.inertia).at[jnp.arange(3), jnp.arange(3)].set(values[10:])
        start = AttitudeState(values[:4], values[4:7])
        craft = spacecraft(inertia, values[7:10])
        return simulate_on_grid(craft, start, table, grid, torques=TORQUES).quaternion

    program, x = compiled(jax.jacfwd(quaternion)), jnp.zeros(size)
    return lambda: program(x)


def day_of(size: int) -> tuple[Satellite, TableSession, Twin]:
    """A satellite, and so many seconds of its magnetometer, gyro and Sun at 1 Hz with their truth."""
    with tempfile.TemporaryDirectory() as folder:
        description, table = Path(folder) / "day.sat.toml", Path(folder) / "day.csv"
        description.write_text(SATELLITE)
        satellite = read_satellite(description)
        twin = make_twin(
            satellite, TwinSettings(duration_s=size - 1.0, every_s=1.0, rate_deg_s=RATE_DEG_S, nominal=True, seed=3)
        )
        table.write_text(table_text(twin))
        return satellite, read_telemetry(table, satellite), twin


def samples(size: int) -> Work:
    """A local fit of 18 unknowns to so many seconds of magnetometer, gyro and Sun at 1 Hz."""
    satellite, session, twin = day_of(size)
    around, _ = session_surroundings(satellite, session)
    data = Samples.of(session.channels, session.epoch, {})
    rate = 1.3 * float(np.radians(np.linalg.norm(RATE_DEG_S)))
    step = step_for(RK4, rate, float(size), 2e-4)
    problem = build_problem(data, satellite.model, around, delayed=(), max_step=step, room_for=step)
    names = ["magnet", "inertia", "mag.bias", "gyro.bias"]
    chosen = chosen_leaves(satellite.leaves, names)
    parameters = free_parameters(satellite.model, satellite.leaves, chosen, held=satellite.held)
    stage = Stage(len(data.t) - 1, 10**9, ITERATIONS, PLAIN, parameters.everything)
    x = np.zeros((1, len(parameters.everything)))
    x[0, :3] = OFF
    x[0, 3:6] = np.asarray(twin.motion.angular_velocity)[0] * 60.0 + 60.0 * OFF / size
    reference = np.asarray(twin.motion.quaternion)[:1]
    weight = usable(problem, data)

    def work():
        point = solve(problem, parameters, stage, x, reference, weight)
        if not float(point.decrement[0]) < FINISHED:
            raise RuntimeError(
                f"no minimum after {ITERATIONS} steps: another one promises {float(point.decrement[0]):.1e}"
            )
        return point.cost

    return work


POINTS: dict[str, Callable[[int], Work]] = {f.__name__: f for f in (cases, arc, read, free, samples)}


def memory(key: str) -> float:
    """`VmRSS` or `VmHWM` of this process [MB]; NaN where the system has no such thing."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return float("nan")
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith(key)), float("nan"))


def measured(work: Work) -> dict[str, float]:
    """Times [s] and peak [MB] of a piece of work."""
    gc.collect()
    reset = Path("/proc/self/clear_refs")
    if reset.exists():
        reset.write_text("5")
    before, began = memory("VmRSS"), time.perf_counter()
    jax.block_until_ready(work())
    first = time.perf_counter() - began
    peak = memory("VmHWM") - before
    best = cpu = np.inf
    for _ in range(1 if first > 20.0 else 3):
        began, used = time.perf_counter(), time.process_time()
        jax.block_until_ready(work())
        best, cpu = min(best, time.perf_counter() - began), min(cpu, time.process_time() - used)
    return {"first_s": first, "s": best, "cpu_s": cpu, "peak_MB": peak}


if __name__ == "__main__":
    print(json.dumps(measured(POINTS[sys.argv[1]](int(sys.argv[2])))))
