"""The job on which integrators are compared: 10 000 attitudes along one circular orbit, in plain NumPy.

A rigid body under the gravity gradient of a point-mass Earth and the torque of a permanent magnet, in a centred tilted
dipole field that turns with the Earth. Quaternions scalar first, inertial-from-body; SI units.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy import cos, sin
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

CASES = 10_000
DURATION = 4500.0
MAX_RATE = 0.02
SEED = 20010118
MU = 3.986004415e14
EARTH_RADIUS = 6371.2e3
ALTITUDE = 750e3
INCLINATION = np.deg2rad(82.0)
NODE = np.deg2rad(40.0)
LATITUDE_ARGUMENT = np.deg2rad(15.0)
"""At t = 0, from the ascending node."""
DIPOLE = np.array([-1410.3e-9, 4545.5e-9, -29350.0e-9])
"""Coefficients (g11, h11, g10) of the main field in 2025 [T], a vector in Earth-fixed axes."""
GREENWICH_ANGLE = np.deg2rad(117.0)
"""At t = 0."""
EARTH_RATE = 7.292115855e-5
INERTIA = np.array([[0.0528, 0.0004, -0.0003], [0.0004, 0.0540, 0.0002], [-0.0003, 0.0002, 0.0500]])
MAGNET = np.array([0.3, 0.01, -0.015])
HARDEST = (41, 2143, 3036, 3564, 3578, 3862, 4558, 4599, 5267, 6032, 7194, 7665, 8968, 9516)
"""Cases whose motion magnifies an error most (some 10^4 times): of all, those where steps of 12 s and of 1.5 s of order
8 differ most, and those where long Adams steps are off most. They stand for the worst case without integrating all
10 000 at the reference's accuracy."""

UNKNOWNS = ("q0", "q1", "q2", "q3", "wx", "wy", "wz", "mx", "my", "mz", "Ja", "Jb", "Jc")
"""What the sensitivities are taken to: initial attitude and rate, magnet, principal moments with their axes fixed."""


@dataclass(frozen=True)
class Job:
    """Everything that defines the job; `Job()` is the one that figures are quoted for."""

    cases: int = CASES
    duration: float = DURATION
    max_rate: float = MAX_RATE
    seed: int = SEED
    inertia: Array = field(default_factory=INERTIA.copy)
    """Inertia tensor, body axes [kg m^2]."""
    magnet: Array = field(default_factory=MAGNET.copy)
    """Permanent dipole, body axes [A m^2]."""
    mu: float = MU
    radius: float = EARTH_RADIUS + ALTITUDE
    """Of the orbit [m]."""

    @cached_property
    def quaternions(self) -> Array:
        """Initial attitudes, uniform over all rotations, (cases, 4); case k is the same however many there are."""
        q = np.random.default_rng([self.seed, 0]).normal(size=(self.cases, 4))
        return q / np.linalg.norm(q, axis=1, keepdims=True)

    @cached_property
    def rates(self) -> Array:
        """Initial angular velocities, body axes, uniform in a ball of radius `max_rate` [rad/s], (cases, 3)."""
        direction = np.random.default_rng([self.seed, 1]).normal(size=(self.cases, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        fraction = np.random.default_rng([self.seed, 2]).random((self.cases, 1)) ** (1 / 3)
        return self.max_rate * fraction * direction

    @cached_property
    def initial(self) -> Array:
        """Initial states (q, w), (cases, 7)."""
        return np.concatenate([self.quaternions, self.rates], axis=1)

    @cached_property
    def mean_motion(self) -> float:
        """Angular rate of the orbit [rad/s]."""
        return float(np.sqrt(self.mu / self.radius**3))

    @cached_property
    def node_axes(self) -> Array:
        """Unit vectors to the ascending node, 90 deg ahead of it, and along the orbit's normal; inertial axes, rows."""
        node = np.array([cos(NODE), sin(NODE), 0.0])
        ahead = np.array([-cos(INCLINATION) * sin(NODE), cos(INCLINATION) * cos(NODE), sin(INCLINATION)])
        return np.stack([node, ahead, np.cross(node, ahead)])

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal moments [kg m^2] and dcm_body_from_principal."""
        moments, axes = np.linalg.eigh(self.inertia)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        return moments, axes

    def field_and_position(self, t: ArrayLike) -> tuple[Array, Array]:
        """Magnetic flux density [T] and position [m] at times [s], inertial axes, (..., 3) each.

        B = (R/r)^3 (3 (g . e) e - g), e the unit position, g the dipole turned by the Greenwich angle.
        """
        t = np.asarray(t, float)[..., None]
        u, turned = LATITUDE_ARGUMENT + self.mean_motion * t, GREENWICH_ANGLE + EARTH_RATE * t
        e = cos(u) * self.node_axes[0] + sin(u) * self.node_axes[1]
        (g11, h11, g10), c, s = DIPOLE, cos(turned), sin(turned)
        g = np.concatenate([c * g11 - s * h11, s * g11 + c * h11, np.full_like(c, g10)], axis=-1)
        return (EARTH_RADIUS / self.radius) ** 3 * (3.0 * np.sum(g * e, -1, keepdims=True) * e - g), self.radius * e

    def derivative(self, t: float, q: Array, w: Array, inertia: Array, magnet: Array) -> tuple[Array, Array]:
        """Time derivatives of attitudes (cases, 4) and rates (cases, 3); one inertia and magnet for all, or one each.

        J w' = 3 mu/r^3 e x J e + m x B - w x J w,   q' = q (0, w) / 2.
        """
        field_inertial, position = self.field_and_position(t)
        b, e = _to_body(q, field_inertial), _to_body(q, position / self.radius)
        gravity_gradient = 3.0 * self.mu / self.radius**3 * np.cross(e, _times(inertia, e))
        torque = gravity_gradient + np.cross(magnet, b) - np.cross(w, _times(inertia, w))
        scalar, vector = q[:, :1], q[:, 1:]
        q_dot = np.concatenate([-np.sum(vector * w, 1, keepdims=True), scalar * w + np.cross(vector, w)], axis=1)
        return 0.5 * q_dot, _times(np.linalg.inv(inertia), torque)


def reference(
    job: Job, cases: list[int], *, inertia: Array | None = None, magnet: Array | None = None, start: Array | None = None
) -> Array:
    """Final states (q, w) of the chosen cases, or from the states `start`, (cases, 7), by SciPy's DOP853.

    Good to 1e-8 in the hardest cases, where rounding itself is magnified, and to 1e-11 in the usual ones.
    """
    y = job.initial[cases] if start is None else start
    shape = y.shape
    inertia, magnet = job.inertia if inertia is None else inertia, job.magnet if magnet is None else magnet

    def flat(t, y):
        y = y.reshape(shape)
        return np.concatenate(job.derivative(t, y[:, :4], y[:, 4:], inertia, magnet), axis=1).ravel()

    scale = np.broadcast_to([1.0] * 4 + [job.max_rate] * 3, shape).ravel()
    solution = solve_ivp(flat, (0.0, job.duration), y.ravel(), "DOP853", rtol=3e-14, atol=3e-15 * scale)
    return solution.y[:, -1].reshape(shape)


def reference_jacobian(job: Job, case: int, *, step: float = 3e-6) -> Array:
    """Derivatives of the final (q, w) with respect to `UNKNOWNS`, (7, 13), by fourth-order central differences.

    Attitudes are moved along the unit sphere: J (1 - q q^T) in the first four columns, whatever the model does off it.
    """
    moments, axes = job.principal
    nominal = np.concatenate([job.quaternions[case], job.rates[case], job.magnet, moments])
    # The motion answers rates and moments, which turn it throughout, an order more strongly than the others.
    size = [1.0, 0.1 * job.max_rate, float(np.linalg.norm(job.magnet)), 0.1 * float(moments.mean())]
    scale = np.repeat(size, [4, 3, 3, 3])
    offsets = np.array([-2.0, -1.0, 1.0, 2.0])
    moved = nominal + (offsets[:, None, None] * step * np.diag(scale)).reshape(-1, len(nominal))
    moved[:, :4] /= np.linalg.norm(moved[:, :4], axis=1, keepdims=True)
    inertia = np.einsum("ij,nj,kj->nik", axes, moved[:, 10:], axes)
    final = reference(job, [], inertia=inertia, magnet=moved[:, 7:10], start=moved[:, :7]).reshape(4, len(nominal), 7)
    return (np.array([1.0, -8.0, 8.0, -1.0]) @ final.reshape(4, -1)).reshape(-1, 7).T / (12.0 * step * scale)


def along_sphere(jacobian: Array, q: Array) -> Array:
    """The Jacobian (..., 13) with its first four columns projected on the tangent of the unit sphere at `q`."""
    radial = np.sum(jacobian[..., :4] * q, axis=-1, keepdims=True)
    return np.concatenate([jacobian[..., :4] - radial * q, jacobian[..., 4:]], axis=-1)


def quaternion_product(a: Array, b: Array) -> Array:
    """Hamilton product, over leading axes."""
    (s, u), (t, v) = (a[..., :1], a[..., 1:]), (b[..., :1], b[..., 1:])
    return np.concatenate([s * t - np.sum(u * v, -1, keepdims=True), s * v + t * u + np.cross(u, v)], axis=-1)


def error_of_each(q: Array, q_reference: Array) -> Array:
    """Greatest difference of a component in each case, whichever the quaternion's sign."""
    return np.minimum(np.abs(q - q_reference).max(axis=1), np.abs(q + q_reference).max(axis=1))


def worst_error(q: Array, q_reference: Array) -> float:
    """Greatest of `error_of_each`."""
    return float(error_of_each(q, q_reference).max())


@dataclass(frozen=True)
class Timing:
    """Seconds of one call."""

    best: float
    median: float
    cpu: float
    """Least processor time of all threads together: the one to trust where other processes run."""


def timed(call: Callable[[], object], *, repeats: int = 5) -> Timing:
    """Wall and processor time of a call that has run once already."""
    wall, cpu = [], []
    for _ in range(repeats):
        began, began_cpu = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - began)
        cpu.append(time.process_time() - began_cpu)
    return Timing(min(wall), float(np.median(wall)), min(cpu))


@dataclass(frozen=True)
class Peer:
    """One way to do the job, compiled."""

    name: str
    compile_s: float
    run: Callable[[], Array]
    """The timed part."""
    states: Callable[[Array], Array]
    """From what `run` returns to final (q, w), or its Jacobian, in the job's frames."""


def measure(peer: Peer, error: Callable[[Array], float], *, repeats: int = 5) -> tuple[Timing, float]:
    """Time a peer, find the error of its states and print both as a row of the table."""
    achieved = error(peer.states(peer.run()))
    timing = timed(peer.run, repeats=repeats)
    times = " ".join(f"{1e3 * t:8.2f}" for t in (timing.best, timing.median, timing.cpu))
    print(f"{peer.name:66s} {peer.compile_s:7.1f} {times} {achieved:9.1e}", flush=True)
    return timing, achieved


def print_header(errors: str) -> None:
    """Heading of the rows that `measure` prints."""
    heads = "compile s", "best ms", "median", "cpu"
    print(f"{'':64s}{heads[0]:>9s} " + " ".join(f"{head:>8s}" for head in heads[1:]) + f" {errors:>9s}")


def _to_body(q: Array, inertial: Array) -> Array:
    """Components in body axes of one inertial vector, for each attitude."""
    scalar, vector = q[:, :1], q[:, 1:]
    twice = 2.0 * np.cross(vector, inertial)
    return inertial - scalar * twice + np.cross(vector, twice)


def _times(matrix: NDArray, vectors: Array) -> Array:
    return np.einsum("...ij,...j->...i", matrix, vectors)
