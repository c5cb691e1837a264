"""The attitude job by numba: lanes of trajectories side by side in the vector registers, the orbit tabulated.

Three integrators as one would write them for speed: the classical RK4, the twelve stages of order eight of Dormand and
Prince, and Adams predictor-corrector. Their loops are generated as source: the compiler sees straight-line code.

.venv/bin/python experiments/benchmarks/peers_numba.py
"""

import os
import time
from collections.abc import Callable
from fractions import Fraction

import llvmlite.binding as llvm  # pyright: ignore[reportMissingImports]
import numpy as np
from models.attitude_job import (
    HARDEST,
    Array,
    Job,
    Peer,
    measure,
    print_header,
    quaternion_product,
    reference,
    worst_error,
)
from numpy.typing import ArrayLike
from scipy.integrate._ivp import dop853_coefficients
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

# LLVM keeps to 256 bits on processors that have 512, unless told before numba is imported.
os.environ.setdefault("NUMBA_CPU_NAME", llvm.get_host_cpu_name())
os.environ.setdefault("NUMBA_CPU_FEATURES", llvm.get_host_cpu_features().flatten() + ",-prefer-256-bit")
import numba  # noqa: E402  # pyright: ignore[reportMissingImports]

LANES = 8
CHECKED = [*range(32), *HARDEST]

RK4 = (np.array([[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]]), np.array([1, 2, 2, 1]) / 6)
RK8 = (dop853_coefficients.A[:12, :12], dop853_coefficients.B)

STATE = ("q0", "q1", "q2", "q3", "w0", "w1", "w2")
"""In registers: sqrt(2) times the quaternion of principal axes, half the rate; see `state_map`."""

SLOPE = """
t0 = 1.0 - q1 * q1
t1 = 1.0 - q2 * q2
r00 = t1 - q3 * q3
r11 = t0 - q3 * q3
r22 = t0 - q2 * q2
r01 = q1 * q2 - q0 * q3
r10 = q1 * q2 + q0 * q3
r02 = q1 * q3 + q0 * q2
r20 = q1 * q3 - q0 * q2
r12 = q2 * q3 - q0 * q1
r21 = q2 * q3 + q0 * q1
e0 = r00 * {0} + r10 * {1} + r20 * {2}
e1 = r01 * {0} + r11 * {1} + r21 * {2}
e2 = r02 * {0} + r12 * {1} + r22 * {2}
b0 = r00 * {3} + r10 * {4} + r20 * {5}
b1 = r01 * {3} + r11 * {4} + r21 * {5}
b2 = r02 * {3} + r12 * {4} + r22 * {5}
{k}0 = -q1 * w0 - q2 * w1 - q3 * w2
{k}1 = q0 * w0 + q2 * w2 - q3 * w1
{k}2 = q0 * w1 + q3 * w0 - q1 * w2
{k}3 = q0 * w2 + q1 * w1 - q2 * w0
{k}4 = SHAPE0 * (w1 * w2 - e1 * e2) + (M10 * b2 - M20 * b1)
{k}5 = SHAPE1 * (w2 * w0 - e2 * e0) + (M21 * b0 - M01 * b2)
{k}6 = SHAPE2 * (w0 * w1 - e0 * e1) + (M02 * b1 - M12 * b0)
"""
"""Right-hand side: 59 operations where a multiplication and an addition count as one."""


def constants(job: Job) -> dict[str, float]:
    """Numbers that the right-hand side carries in its text; Mij is half the magnet's component i over moment j."""
    moments, axes = job.principal
    magnet = 0.5 * job.magnet @ axes
    shape = {f"SHAPE{i}": 2.0 * (moments[(i + 1) % 3] - moments[(i + 2) % 3]) / moments[i] for i in range(3)}
    return shape | {f"M{i}{j}": magnet[i] / moments[j] for i in range(3) for j in range(3)}


def state_map(job: Job) -> Array:
    """(7, 7), from the job's state to that in registers."""
    axes = job.principal[1]
    principal = Rotation.from_matrix(axes).as_quat(scalar_first=True)
    return np.asarray(block_diag(np.sqrt(2.0) * quaternion_product(np.eye(4), principal).T, 0.5 * axes.T))


def environment(job: Job, times: ArrayLike) -> Array:
    """What the right-hand side reads at the nodes: sqrt(3)/2 n e and B, inertial axes, (..., 6)."""
    b, position = job.field_and_position(times)
    return np.concatenate([0.5 * np.sqrt(3.0) * job.mean_motion / job.radius * position, b], axis=-1)


def slope(name: str, point: str) -> list[str]:
    """Lines for the derivatives `name`0..6 at the state in registers; `point` names the six tabulated numbers."""
    return SLOPE.format(*(f"{point}{v}" for v in range(6)), k=name).strip().splitlines()


def combination(start: str, weights: Array, slopes: list[str]) -> str:
    """Text of start + sum of weights times slopes, zeros left out."""
    terms = [f"{float(w)!r} * {s}" for w, s in zip(weights, slopes, strict=True) if w]
    return f"{start} + ({' + '.join(terms)})" if terms else start


def runge_kutta(a: Array, b: Array, h: float) -> tuple[list[str], list[str]]:
    """Lines that load a step's points, and those that take the step from y0..6 to y0..6, k0_0..6 its first slope."""
    load = [f"p{i}_{v} = points[n, {i}, {v}]" for i in range(len(b)) for v in range(6)]
    lines = []
    for i in range(len(b)):
        for v, name in enumerate(STATE):
            lines.append(f"{name} = " + combination(f"y{v}", h * a[i, :i], [f"k{j}_{v}" for j in range(i)]))
        lines += slope(f"k{i}_", f"p{i}_")
    lines += [f"y{v} = " + combination(f"y{v}", h * b, [f"k{j}_{v}" for j in range(len(b))]) for v in range(7)]
    return load, lines


def adams_weights(points: int, *, newest: int) -> Array:
    """Weights of the slopes at times newest, newest - 1, ... in steps, for the integral from 0 to 1."""
    nodes = [Fraction(newest - j) for j in range(points)]
    rows = [[x**i for x in nodes] + [Fraction(1, i + 1)] for i in range(points)]
    for i in range(points):
        pivot = next(r for r in range(i, points) if rows[r][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for r in range(points):
            if r != i:
                rows[r] = [x - rows[r][i] * y for x, y in zip(rows[r], rows[i], strict=True)]
    return np.array([float(row[-1]) for row in rows])


def indented(lines: list[str], depth: int) -> str:
    return "".join(f"{' ' * depth}{line}\n" for line in lines)


def compiled(source: str, job: Job) -> Callable:
    """Numba's function `run` of generated source, the job's constants written into it."""
    for name, value in constants(job).items():
        source = source.replace(name, repr(float(value)))
    scope = {"prange": numba.prange, "np": np}
    exec(source, scope)
    return numba.njit(parallel=True, fastmath=True, error_model="numpy")(scope["run"])


def row(number: int) -> str:
    """Row of lanes in the work array `z`: one flat array, so that the compiler knows that its rows do not overlap."""
    return f"z[{number * LANES} + l]"


def runge_kutta_source(a: Array, b: Array, h: float) -> str:
    """Source of run(states, points): all steps of the method, in place; points are (steps, stages, 6)."""
    load, step = runge_kutta(a, b, h)
    step = [f"y{v} = {row(v)}" for v in range(7)] + step + [f"{row(v)} = y{v}" for v in range(7)]
    return (
        "def run(states, points):\n"
        " for block in prange(states.shape[0]):\n"
        "  z = states[block]\n"
        "  for n in range(points.shape[0]):\n"
        f"{indented(load, 3)}"
        f"   for l in range({LANES}):\n"
        f"{indented(step, 4)}"
    )


def adams_source(order: int, h: float, *, room: int = 16) -> str:
    """Source of run(states, points, nodes): predict, evaluate, correct, evaluate with `order` slopes in each formula.

    `points` serve the first order - 1 steps, by Runge-Kutta of order eight; `nodes` are (steps + 1, 6). States and
    slopes of the last `order` times and the next are 14 rows each of a window that slides `room` steps and jumps back.
    """
    width = 14 * LANES
    state, slopes = ([[row(14 * k + part + v) for v in range(7)] for k in range(order + 1)] for part in (0, 7))
    load, start = runge_kutta(*RK8, h)
    start = [f"y{v} = {state[0][v]}" for v in range(7)] + start
    start += [f"{state[1][v]} = y{v}" for v in range(7)] + [f"{slopes[0][v]} = k0_{v}" for v in range(7)]
    begin = [f"{name} = {state[0][v]}" for v, name in enumerate(STATE)] + slope("f", "p")
    begin += [f"{slopes[0][v]} = f{v}" for v in range(7)]
    predictor, corrector = (h * adams_weights(order, newest=newest) for newest in (0, 1))
    step = []
    for v, name in enumerate(STATE):
        past = [f"h{order - 1 - k}" for k in range(order)]
        step += [f"{past[order - 1 - k]} = {slopes[k][v]}" for k in range(order)] + [f"y{v} = {state[order - 1][v]}"]
        step += [f"c{v} = " + combination(f"y{v}", corrector[1:], past[:-1])]
        step += [f"{name} = " + combination(f"y{v}", predictor, past)]
    step += slope("f", "p") + [f"{name} = c{v} + {corrector[0]!r} * f{v}" for v, name in enumerate(STATE)]
    step += slope("f", "p") + [f"{state[order][v]} = {name}" for v, name in enumerate(STATE)]
    step += [f"{slopes[order][v]} = f{v}" for v in range(7)]
    point = [f"p{v} = nodes[n, {v}]" for v in range(6)]
    return (
        "def run(states, points, nodes):\n"
        " for block in prange(states.shape[0]):\n"
        f"  window = np.empty({width * (order + room)})\n"
        f"  window[:{7 * LANES}] = states[block]\n"
        f"  for n in range({order - 1}):\n"
        f"   z = window[{width} * n:]\n"
        f"{indented(load, 3)}"
        f"   for l in range({LANES}):\n"
        f"{indented(start, 4)}"
        f"  n = {order - 1}\n"
        f"  z = window[{width} * n:]\n"
        f"{indented(point, 2)}"
        f"  for l in range({LANES}):\n"
        f"{indented(begin, 3)}"
        "  at = 0\n"
        f"  for n in range({order}, nodes.shape[0]):\n"
        f"   z = window[{width} * at:]\n"
        f"{indented(point, 3)}"
        f"   for l in range({LANES}):\n"
        f"{indented(step, 4)}"
        "   at += 1\n"
        f"   if at == {room}:\n"
        f"    window[:{width * order}] = window[{width * room}:]\n"
        "    at = 0\n"
        f"  z = window[{width} * (at + {order - 1}):]\n"
        f"  states[block] = z[:{7 * LANES}]\n"
    )


def peer(job: Job, name: str, source: str, tables: tuple[Array, ...]) -> Peer:
    """The job by one compiled loop."""
    to_registers = state_map(job)
    states = job.initial @ to_registers.T
    filled = np.concatenate([states, np.repeat(states[-1:], -job.cases % LANES, axis=0)])
    blocks = np.ascontiguousarray(filled.reshape(-1, LANES, 7).transpose(0, 2, 1)).reshape(-1, 7 * LANES)
    began = time.perf_counter()
    integrate = compiled(source, job)
    integrate(blocks[:1].copy(), *tables)
    compile_s = time.perf_counter() - began

    def run() -> Array:
        final = blocks.copy()
        integrate(final, *tables)
        return final

    def final_states(final: Array) -> Array:
        lanes = final.reshape(-1, 7, LANES).transpose(0, 2, 1).reshape(-1, 7)[: job.cases]
        return lanes @ np.linalg.inv(to_registers).T

    return Peer(name, compile_s, run, final_states)


def runge_kutta_peer(job: Job, order: int, step: float) -> Peer:
    """The job by RK4 or RK8 with the number of steps next to `step` seconds."""
    a, b = {4: RK4, 8: RK8}[order]
    steps = round(job.duration / step)
    h = job.duration / steps
    times = (np.arange(steps)[:, None] + a.sum(axis=1)) * h
    return peer(job, f"RK{order}, {steps} steps of {h:.2f} s", runge_kutta_source(a, b, h), (environment(job, times),))


def adams_peer(job: Job, order: int, step: float) -> Peer:
    """The job by the Adams method of `order` in predictor and corrector."""
    steps = round(job.duration / step)
    h = job.duration / steps
    first = environment(job, (np.arange(order - 1)[:, None] + RK8[0].sum(axis=1)) * h)
    nodes = environment(job, np.arange(steps + 1) * h)
    return peer(job, f"Adams {order}, {steps} steps of {h:.2f} s", adams_source(order, h), (first, nodes))


def main() -> None:
    job = Job()
    truth = reference(job, CHECKED)

    def error(states: Array) -> float:
        return worst_error(states[CHECKED, :4], truth[:, :4])

    print_header("worst q")
    for step in (1.0, 0.22):
        measure(runge_kutta_peer(job, 4, step), error)
    for step in (15.0, 12.0, 9.3, 6.0):
        measure(runge_kutta_peer(job, 8, step), error)
    for order, step in ((8, 1.8), (10, 2.85), (11, 3.2), (12, 3.0)):
        measure(adams_peer(job, order, step), error)


if __name__ == "__main__":
    main()
