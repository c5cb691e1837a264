"""The attitude job by heyoka's batch-mode Taylor integrator, at the loosest tolerance of each order.

.venv/bin/python experiments/benchmarks/peers_heyoka.py
"""

import os
import time
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import heyoka as hy  # pyright: ignore[reportMissingImports]
import numpy as np
from models.attitude_job import (
    DIPOLE,
    EARTH_RADIUS,
    EARTH_RATE,
    GREENWICH_ANGLE,
    HARDEST,
    LATITUDE_ARGUMENT,
    Array,
    Job,
    Peer,
    along_sphere,
    measure,
    print_header,
    quaternion_product,
    reference,
    reference_jacobian,
    worst_error,
)
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

THREADS = os.cpu_count() or 1
CHECKED = [*range(32), *HARDEST]


@dataclass(frozen=True)
class Maps:
    """Linear maps between the job's state and that of the equations: attitude of principal against orbital axes."""

    start: Array
    """(7, 7), of the initial state."""
    end: Array
    """(7, 7), back, of the final one."""


def job_maps(job: Job) -> Maps:
    """The job's maps to and from principal axes against the orbital frame (radial, along the track, normal)."""

    axes = job.principal[1]
    node, principal = (Rotation.from_matrix(m).as_quat(scalar_first=True) for m in (job.node_axes.T, axes))
    conjugate = np.array([1.0, -1.0, -1.0, -1.0])

    def orbital(t: float) -> Array:
        # From the half angle, so that the quaternion keeps its sign along the orbit.
        half = 0.5 * (LATITUDE_ARGUMENT + job.mean_motion * t)
        return quaternion_product(node, np.array([np.cos(half), 0.0, 0.0, np.sin(half)]))

    def state_map(left: Array, right: Array, dcm: Array) -> Array:
        return np.asarray(block_diag(quaternion_product(quaternion_product(left, np.eye(4)), right).T, dcm))

    return Maps(
        start=state_map(orbital(0.0) * conjugate, principal, axes.T),
        end=state_map(orbital(job.duration), principal * conjugate, axes),
    )


def orbital_field(job: Job) -> list[hy.expression]:
    """Magnetic field in the orbital frame, each component a sum of harmonics of time.

    There B = (R/r)^3 (2 g_r, -g_t, -g_n), and g_r + i g_t turns at minus the mean motion and that +- the Earth's rate.
    """
    (g11, h11, g10), (node, ahead, normal) = DIPOLE, job.node_axes
    turning = (g11 + 1j * h11) * np.exp(1j * GREENWICH_ANGLE)
    plane = node + 1j * ahead
    back = np.exp(-1j * LATITUDE_ARGUMENT)
    n = job.mean_motion
    harmonics = [
        (0.5 * turning * (plane[0] - 1j * plane[1]) * back, EARTH_RATE - n),
        (0.5 * np.conj(turning) * (plane[0] + 1j * plane[1]) * back, -EARTH_RATE - n),
        (g10 * plane[2] * back, -n),
    ]
    across = turning * (normal[0] - 1j * normal[1])

    def parts(amplitude: complex, rate: float) -> list[hy.expression]:
        angle = rate * hy.time + float(np.angle(amplitude))
        return [float(abs(amplitude)) * hy.cos(angle), float(abs(amplitude)) * hy.sin(angle)]

    radial, along = (hy.sum([parts(*h)[k] for h in harmonics]) for k in (0, 1))
    scale = (EARTH_RADIUS / job.radius) ** 3
    return [2.0 * scale * radial, -scale * along, -scale * (parts(across, EARTH_RATE)[0] + float(g10 * normal[2]))]


def equations(job: Job, moments: list, magnet: list) -> list[tuple[hy.expression, hy.expression]]:
    """The system in principal axes against the orbital frame, where the vertical is a row of the rotation matrix."""
    q0, q1, q2, q3 = q = hy.make_vars("q0", "q1", "q2", "q3")
    w = hy.make_vars("wx", "wy", "wz")
    n = job.mean_motion
    rows = [
        [1.0 - 2.0 * (q2 * q2 + q3 * q3), 2.0 * (q1 * q2 - q0 * q3), 2.0 * (q1 * q3 + q0 * q2)],
        [2.0 * (q1 * q2 + q0 * q3), 1.0 - 2.0 * (q1 * q1 + q3 * q3), 2.0 * (q2 * q3 - q0 * q1)],
        [2.0 * (q1 * q3 - q0 * q2), 2.0 * (q2 * q3 + q0 * q1), 1.0 - 2.0 * (q1 * q1 + q2 * q2)],
    ]
    field = orbital_field(job)
    b = [rows[0][i] * field[0] + rows[1][i] * field[1] + rows[2][i] * field[2] for i in range(3)]
    e = rows[0]
    w_dot = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        shape = (moments[j] - moments[k]) / moments[i]
        turn = shape * (w[j] * w[k] - 3.0 * n * n * (e[j] * e[k]))
        w_dot.append(turn + (magnet[j] / moments[i]) * b[k] - (magnet[k] / moments[i]) * b[j])
    q_dot = [
        -0.5 * (q1 * w[0] + q2 * w[1] + q3 * w[2]) + 0.5 * n * q3,
        0.5 * (q0 * w[0] + q2 * w[2] - q3 * w[1]) + 0.5 * n * q2,
        0.5 * (q0 * w[1] + q3 * w[0] - q1 * w[2]) - 0.5 * n * q1,
        0.5 * (q0 * w[2] + q1 * w[1] - q2 * w[0]) - 0.5 * n * q0,
    ]
    return list(zip([*q, *w], [*q_dot, *w_dot], strict=True))


def inertial_equations(job: Job) -> list[tuple[hy.expression, hy.expression]]:
    """The system as a textbook has it: inertial frame, body axes, full inertia tensor."""
    q0, q1, q2, q3 = q = hy.make_vars("q0", "q1", "q2", "q3")
    w = hy.make_vars("wx", "wy", "wz")
    n, inertia, magnet = job.mean_motion, job.inertia.tolist(), job.magnet.tolist()
    inverse = np.linalg.inv(job.inertia).tolist()
    u, turned = LATITUDE_ARGUMENT + n * hy.time, GREENWICH_ANGLE + EARTH_RATE * hy.time
    (g11, h11, g10), (node, ahead, _) = DIPOLE.tolist(), job.node_axes.tolist()
    position = [node[i] * hy.cos(u) + ahead[i] * hy.sin(u) for i in range(3)]
    c, s = hy.cos(turned), hy.sin(turned)
    dipole = [g11 * c - h11 * s, g11 * s + h11 * c, hy.expression(g10)]
    along = hy.sum([dipole[i] * position[i] for i in range(3)])
    field = [(EARTH_RADIUS / job.radius) ** 3 * (3.0 * along * position[i] - dipole[i]) for i in range(3)]

    def product(matrix, v):
        return [hy.sum([row[k] * v[k] for k in range(3)]) for row in matrix]

    def cross(x, y):
        return [x[j] * y[k] - x[k] * y[j] for j, k in ((1, 2), (2, 0), (0, 1))]

    body_from_inertial = [
        [1.0 - 2.0 * (q2 * q2 + q3 * q3), 2.0 * (q1 * q2 + q0 * q3), 2.0 * (q1 * q3 - q0 * q2)],
        [2.0 * (q1 * q2 - q0 * q3), 1.0 - 2.0 * (q1 * q1 + q3 * q3), 2.0 * (q2 * q3 + q0 * q1)],
        [2.0 * (q1 * q3 + q0 * q2), 2.0 * (q2 * q3 - q0 * q1), 1.0 - 2.0 * (q1 * q1 + q2 * q2)],
    ]
    e, b = product(body_from_inertial, position), product(body_from_inertial, field)
    parts = zip(cross(e, product(inertia, e)), cross(magnet, b), cross(w, product(inertia, w)), strict=True)
    w_dot = product(
        inverse, [3.0 * n * n * gradient + magnetic - gyroscopic for gradient, magnetic, gyroscopic in parts]
    )
    q_dot = [
        -0.5 * (q1 * w[0] + q2 * w[1] + q3 * w[2]),
        0.5 * (q0 * w[0] + q2 * w[2] - q3 * w[1]),
        0.5 * (q0 * w[1] + q3 * w[0] - q1 * w[2]),
        0.5 * (q0 * w[2] + q1 * w[1] - q2 * w[0]),
    ]
    return list(zip([*q, *w], [*q_dot, *w_dot], strict=True))


@dataclass(frozen=True)
class Ensemble:
    """A compiled batch integrator, one copy for each thread."""

    integrators: list

    @property
    def order(self) -> int:
        """Of the Taylor series, which follows from the tolerance; the step follows from the order."""
        return self.integrators[0].order

    def run(self, blocks: Array, duration: float) -> Array:
        """Final states, derivatives included where there are any, from initial ones (blocks, 7, batch).

        Threads with an integrator each, 2.5 times as fast as `run_by_library`, which copies one for every batch.
        """
        initial = np.array(self.integrators[0].state)
        final = np.empty((len(blocks), *initial.shape))

        def work(number: int) -> None:
            integrator = self.integrators[number]
            for k in range(number, len(blocks), len(self.integrators)):
                integrator.set_time(0.0)
                integrator.state[:] = initial
                integrator.state[:7] = blocks[k]
                integrator.propagate_until(duration)
                final[k] = integrator.state

        with ThreadPoolExecutor(len(self.integrators)) as pool:
            list(pool.map(work, range(len(self.integrators))))
        # The copies must not start the next run from this one's derivatives.
        self.integrators[0].state[:] = initial
        return final

    def run_by_library(self, blocks: Array, duration: float) -> Array:
        """The same by heyoka's own ensemble mode."""

        def generate(integrator, k: int):
            integrator.state[:] = blocks[k]
            return integrator

        results = hy.ensemble_propagate_until_batch(
            self.integrators[0], duration, len(blocks), generate, max_workers=len(self.integrators)
        )
        return np.stack([result[0].state for result in results])


def compiled(system, state: Array, threads: int, **options: Any) -> tuple[Ensemble, float]:
    """A batch integrator for each thread, and the seconds that compiling took."""
    # Otherwise the second time that anybody runs this it costs nothing.
    hy.llvm_state.set_diskcache_enabled(False)
    hy.llvm_state.clear_memcache()
    began = time.perf_counter()
    first = hy.taylor_adaptive_batch(system, state, **options)
    seconds = time.perf_counter() - began
    return Ensemble([first, *(deepcopy(first) for _ in range(threads - 1))]), seconds


def in_blocks(states: Array, batch: int) -> Array:
    """States (cases, 7) as (blocks, 7, batch), the last block filled up."""
    filled = np.concatenate([states, np.repeat(states[-1:], -len(states) % batch, axis=0)])
    return np.ascontiguousarray(filled.reshape(-1, batch, states.shape[1]).transpose(0, 2, 1))


def from_blocks(blocks: Array, cases: int) -> Array:
    """Inverse of `in_blocks`."""
    return blocks.transpose(0, 2, 1).reshape(-1, blocks.shape[1])[:cases]


def job_peer(
    job: Job,
    *,
    tolerance: float,
    batch: int,
    form: str = "orbital",
    library: bool = False,
    threads: int = THREADS,
    **options: Any,
) -> Peer:
    """The job by heyoka: `form` of the equations orbital or inertial; `library` for its own ensemble mode."""
    if form == "orbital":
        moments, axes = job.principal
        maps, system = job_maps(job), equations(job, moments.tolist(), (job.magnet @ axes).tolist())
    else:
        maps, system = Maps(np.eye(7), np.eye(7)), inertial_equations(job)
    ensemble, compile_s = compiled(system, np.zeros((7, batch)), threads, tol=tolerance, **options)
    initial = in_blocks(job.initial @ maps.start.T, batch)
    run = ensemble.run_by_library if library else ensemble.run
    name = f"{form} batch {batch} tol {tolerance:.0e} order {ensemble.order}{' library' * library} {' '.join(options)}"
    return Peer(
        name, compile_s, lambda: run(initial, job.duration), lambda final: from_blocks(final, job.cases) @ maps.end.T
    )


def sensitivity_peer(job: Job, *, tolerance: float, batch: int, threads: int = THREADS, **options: Any) -> Peer:
    """Final states' derivatives with respect to `UNKNOWNS`, (cases, 7, 13), by first-order variational equations."""
    maps, (moments, axes) = job_maps(job), job.principal
    magnet, inertia = [hy.par[k] for k in range(3)], [hy.par[3 + k] for k in range(3)]
    system = equations(job, inertia, magnet)
    variational = hy.var_ode_sys(system, [*(variable for variable, _ in system), *magnet, *inertia])
    values = np.concatenate([job.magnet @ axes, moments])
    given = {"pars": np.tile(values[:, None], (1, batch)), "tol": tolerance}
    ensemble, compile_s = compiled(variational, np.zeros((7, batch)), threads, **given, **options)
    initial = in_blocks(job.initial @ maps.start.T, batch)
    inputs = np.asarray(block_diag(maps.start, axes.T, np.eye(3)))

    def jacobians(final: Array) -> Array:
        raw = from_blocks(final, job.cases)[:, 7:].reshape(job.cases, 7, 13)
        return along_sphere(maps.end @ raw @ inputs, job.quaternions[:, None])

    name = f"{job.cases} of 7 x 13, batch {batch} tol {tolerance:.0e} order {ensemble.order} {' '.join(options)}"
    return Peer(name, compile_s, lambda: ensemble.run(initial, job.duration), jacobians)


def main() -> None:
    job = Job()
    truth = reference(job, CHECKED)

    def error(states: Array) -> float:
        return worst_error(states[CHECKED, :4], truth[:, :4])

    def first_error(states: Array) -> float:
        return worst_error(states[:1, :4], truth[:1, :4])

    fast: dict[str, Any] = {"fast_math": True, "force_avx512": True}
    wide = 2 * hy.recommended_simd_size()
    print_header("worst q")
    measure(job_peer(job, form="inertial", tolerance=1e-10, batch=wide // 2, library=True), error)
    measure(job_peer(job, form="inertial", tolerance=1e-10, batch=wide), error)
    for batch in (wide // 2, wide, 2 * wide):
        measure(job_peer(job, tolerance=1e-10, batch=batch), error)
    measure(job_peer(job, tolerance=1e-10, batch=wide, compact_mode=True), error)
    for tolerance in (1e-9, 1e-10, 1e-11, 1e-12, 1e-15):
        measure(job_peer(job, tolerance=tolerance, batch=wide, **fast), error)
    one, some = Job(cases=1), Job(cases=32 * wide)
    print_header("case 0")
    for tolerance in (1e-7, 1e-8, 1e-9):
        measure(job_peer(one, tolerance=tolerance, batch=1, threads=1, fast_math=True), first_error, repeats=25)

    jacobian = reference_jacobian(job, 0)

    def column_error(jacobians: Array) -> float:
        return float((np.abs(jacobians[0] - jacobian).max(axis=0) / np.abs(jacobian).max(axis=0)).max())

    print_header("column")
    for options in ({"compact_mode": True}, {}):
        measure(sensitivity_peer(some, tolerance=1e-7, batch=wide, **fast, **options), column_error)
        measure(
            sensitivity_peer(one, tolerance=1e-7, batch=1, threads=1, fast_math=True, **options),
            column_error,
            repeats=15,
        )


if __name__ == "__main__":
    main()
