"""Panel currents of a session in plain NumPy, as one would write them for SciPy: the peer of
`fitting.measurements.problem`.

A rigid body under gravity gradient, permanent magnet and two rods magnetised in proportion to the field, by RK4 over
tabulated position and field; direct, mirrored and scattered light on the six faces of a box. Only tables and numbers
come from outside. Many sets of unknowns are done at once, in the last axis, which is what makes finite differences
bearable in NumPy. Quaternions scalar first, inertial-from-body; SI units.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MU = 3.986004415e14
RATE_UNIT = 1.0 / 60.0
"""Unit of the rate unknowns [rad/s]."""
DIFFERENCE = 1.5e-8
"""Step of the finite differences over the unknown, or over one where that is more: the root of a rounding."""
NEXT, AFTER = [1, 2, 0], [2, 0, 1]


@dataclass(frozen=True)
class Tables:
    """What the model reads."""

    step: Array
    """[steps] lengths [s]."""
    position: Array
    """[2 steps + 1, 3] at start, middle and end of each step, inertial axes [m]."""
    field: Array
    """The same of the magnetic field [T]."""
    sample_state: NDArray[np.int64]
    """[samples] number of the state at each sample; 0 is the initial one."""
    sun: Array
    """[samples 3] unit vectors, inertial axes."""
    illumination: Array
    """[samples]"""
    mirror_direction: Array
    """[samples 3]"""
    mirror_factor: Array
    """[samples]"""
    patch_direction: Array
    """[samples patches 3]"""
    patch_weight: Array
    """[samples patches]"""
    measured: Array
    """[samples 6] +x -x +y -y +z -z [A]."""
    used: NDArray[np.bool_]
    """[samples]"""
    noise: float
    """1 sigma of a current [A]."""


@dataclass(frozen=True)
class Satellite:
    """Nominal numbers and the prior sigmas in which unknowns are counted."""

    magnet: Array
    rods: Array
    inertia: Array
    """xx yy zz xy xz yz [kg m^2]."""
    sigma: Array
    """[11] of magnet, rods and inertia."""
    rods_field: float
    """Field in which the rods have their moments [T]."""
    max_current: float
    specular: float
    diffuse: float


Propagate = Callable[[Tables, Array, Array, Array, Array], Array]
"""Attitudes at the samples (samples, 4, sets) from initial states (7, sets), inertia (3, 3, sets), magnet (3, sets)
and rods (2, sets) per tesla."""


@dataclass(frozen=True)
class Model:
    """Residuals of the fit and their finite differences.

    Unknowns: turn about body axes [rad], rate [rad/min]; shifts of magnet, rods and inertia in prior sigmas.
    """

    tables: Tables
    satellite: Satellite
    reference: Array
    """Attitude that the first three unknowns turn."""
    propagate: Propagate

    def residuals(self, x: Array) -> Array:
        """(modelled - measured) / noise of the samples in use, and the unknowns' own over their prior; (rows, sets)."""
        satellite, n = self.satellite, x.shape[1]
        shift = satellite.sigma[:, None] * x[6:]
        magnet = satellite.magnet[:, None] + shift[0:3]
        # One common scale of magnet, rods and inertia leaves the motion as it is: |magnet| is held.
        scale = np.linalg.norm(satellite.magnet) / np.linalg.norm(magnet, axis=0)
        inertia = inertia_of_body(satellite.inertia, shift[5:11])
        start = np.concatenate([product(self.reference[:, None], from_rotation_vector(x[:3])), x[3:6] * RATE_UNIT])
        rods = (satellite.rods[:, None] + shift[3:5]) / satellite.rods_field
        q = self.propagate(self.tables, start, inertia, scale * magnet, rods)
        residual = (self.currents(q) - self.tables.measured[:, :, None]) / self.tables.noise
        return np.concatenate([residual[self.tables.used].reshape(-1, n), x[6:]])

    def currents(self, q: Array) -> Array:
        """(samples, 6, sets) [A] for attitudes (samples, 4, sets)."""
        t, satellite = self.tables, self.satellite
        light = t.illumination[:, None, None] * faces(to_body(q, t.sun[:, :, None]))
        mirrored = t.mirror_factor[:, None, None] * faces(to_body(q, t.mirror_direction[:, :, None]))
        light = light + satellite.specular * mirrored
        if satellite.diffuse != 0.0:
            directions = t.patch_direction.transpose(0, 2, 1)[..., None]
            patches = faces(to_body(q[:, :, None, :], directions))
            light = light + satellite.diffuse * np.einsum("sk,sfkn->sfn", t.patch_weight, patches)
        return satellite.max_current * light

    def residual(self, x: Array) -> Array:
        """Residuals of one set of unknowns."""
        return self.residuals(x[:, None])[:, 0]

    def jacobian(self, x: Array) -> Array:
        """Forward differences, all columns in one batch; (rows, unknowns)."""
        h = DIFFERENCE * np.maximum(1.0, np.abs(x))
        moved = x[:, None] + np.concatenate([np.zeros((len(x), 1)), np.diag(h)], axis=1)
        r = self.residuals(moved)
        return (r[:, 1:] - r[:, :1]) / h


def tensor(entries: Array) -> Array:
    """(3, 3, sets) from xx yy zz xy xz yz (6, sets)."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_of_body(nominal: Array, shift: Array) -> Array:
    """(3, 3, sets) inertia that any shift (6, sets) leaves that of a body: S = L (I + X/2)^2 L^T, S = tr(J)/2 I - J."""
    identity = np.eye(3)[:, :, None]

    def complement(J: Array) -> Array:
        return 0.5 * np.trace(J)[None, None] * identity - J

    root = np.linalg.cholesky(complement(tensor(nominal[:, None]))[:, :, 0])
    inverse = np.linalg.inv(root)
    change = np.einsum("ij,jkn,lk->iln", inverse, complement(tensor(shift)), inverse)
    stretch = np.einsum("ij,jkn->ikn", root, identity + 0.5 * change)
    second_moment = np.einsum("ikn,jkn->ijn", stretch, stretch)
    return np.trace(second_moment)[None, None] * identity - second_moment


def propagate(tables: Tables, start: Array, inertia: Array, magnet: Array, rods: Array) -> Array:
    """`Propagate` by NumPy: RK4, the quaternion brought back to unit length after each step."""
    inverse = np.linalg.inv(inertia.transpose(2, 0, 1)).transpose(1, 2, 0)
    distance = np.linalg.norm(tables.position, axis=1)
    pull = 3.0 * MU / distance**3
    # Unit position and field side by side, (nodes, 3, 2, 1): turned to body axes together.
    around = np.stack([tables.position / distance[:, None], tables.field], axis=2)[..., None]

    def slope(y, node):
        q, w = y[:4], y[4:]
        vectors = to_body(q[:, None], around[node], axis=0)
        e, b = vectors[:, 0], vectors[:, 1]
        dipole = magnet.copy()
        dipole[1:] += rods * b[1:]
        products = np.einsum("ijn,jkn->ikn", inertia, np.stack([e, w], axis=1))
        # pull e x Je + m x B + Jw x w, in one.
        left = np.stack([pull[node] * e, dipole, products[:, 1]], axis=1)
        right = np.stack([products[:, 0], b, w], axis=1)
        w_dot = np.einsum("ijn,jn->in", inverse, cross(left, right).sum(axis=1))
        u = q[1:]
        return np.concatenate([-0.5 * (u * w).sum(axis=0)[None], 0.5 * (q[0] * w + cross(u, w)), w_dot])

    y = start
    states = [y[:4]]
    for k, h in enumerate(tables.step[: tables.sample_state.max()]):
        k1 = slope(y, 2 * k)
        k2 = slope(y + 0.5 * h * k1, 2 * k + 1)
        k3 = slope(y + 0.5 * h * k2, 2 * k + 1)
        k4 = slope(y + h * k3, 2 * k + 2)
        y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        y[:4] /= np.sqrt((y[:4] ** 2).sum(axis=0))
        states.append(y[:4])
    return np.stack(states)[tables.sample_state]


def cross(a: Array, b: Array) -> Array:
    """Components in the first axis."""
    return a[NEXT] * b[AFTER] - a[AFTER] * b[NEXT]


def to_body(q: Array, inertial: Array, *, axis: int = 1) -> Array:
    """Inertial vectors in body axes; components of both in `axis`."""
    q, v = np.moveaxis(q, axis, 0), np.moveaxis(inertial, axis, 0)
    u = q[1:]
    twice = 2.0 * cross(u, v)
    return np.moveaxis(v - q[0] * twice + cross(u, twice), 0, axis)


def faces(direction: Array) -> Array:
    """max(0, cosine) on +x -x +y -y +z -z of directions whose components are in axis 1."""
    x, y, z = (direction[:, k] for k in range(3))
    return np.maximum(np.stack([x, -x, y, -y, z, -z], axis=1), 0.0)


def product(a: Array, b: Array) -> Array:
    """Hamilton product, components first."""
    a, b = np.broadcast_arrays(a, b)
    scalar = a[0] * b[0] - (a[1:] * b[1:]).sum(axis=0)
    return np.concatenate([scalar[None], a[0] * b[1:] + b[0] * a[1:] + cross(a[1:], b[1:])])


def from_rotation_vector(r: Array) -> Array:
    """Unit quaternions (4, sets) of rotation vectors (3, sets) [rad]."""
    half = 0.5 * np.linalg.norm(r, axis=0)
    return np.concatenate([np.cos(half)[None], 0.5 * np.sinc(half / np.pi) * r])
