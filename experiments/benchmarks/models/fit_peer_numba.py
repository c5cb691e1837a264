"""The trajectories of `fit_peer_model` compiled by numba: what finite differences cost without NumPy's calls."""

import numba  # pyright: ignore[reportMissingImports]
import numpy as np
from models.fit_peer_model import MU, Array, Tables


def propagate(tables: Tables, start: Array, inertia: Array, magnet: Array, rods: Array) -> Array:
    """`fit_peer_model.Propagate`, one set of unknowns after the other."""
    sets = start.shape[1]
    tensor = np.ascontiguousarray(inertia.transpose(2, 0, 1))
    steps = tables.step[: tables.sample_state.max()]
    states = np.empty((sets, len(steps) + 1, 4))
    _trajectories(
        np.ascontiguousarray(start.T),
        tensor,
        np.linalg.inv(tensor),
        np.ascontiguousarray(magnet.T),
        np.ascontiguousarray(rods.T),
        tables.position,
        tables.field,
        3.0 * MU / np.linalg.norm(tables.position, axis=1) ** 5,
        steps,
        states,
    )
    return states[:, tables.sample_state].transpose(1, 2, 0)


@numba.njit(cache=True, fastmath=True)
def _slope(y, position, field, pull, J, inverse, magnet, rods, out):
    s, u0, u1, u2, w0, w1, w2 = y
    r00, r11, r22 = 1 - 2 * (u1 * u1 + u2 * u2), 1 - 2 * (u0 * u0 + u2 * u2), 1 - 2 * (u0 * u0 + u1 * u1)
    r01, r10 = 2 * (u0 * u1 - s * u2), 2 * (u0 * u1 + s * u2)
    r02, r20 = 2 * (u0 * u2 + s * u1), 2 * (u0 * u2 - s * u1)
    r12, r21 = 2 * (u1 * u2 - s * u0), 2 * (u1 * u2 + s * u0)
    x, y_, z = position
    e0, e1, e2 = r00 * x + r10 * y_ + r20 * z, r01 * x + r11 * y_ + r21 * z, r02 * x + r12 * y_ + r22 * z
    x, y_, z = field
    b0, b1, b2 = r00 * x + r10 * y_ + r20 * z, r01 * x + r11 * y_ + r21 * z, r02 * x + r12 * y_ + r22 * z
    f0 = pull * (J[0, 0] * e0 + J[0, 1] * e1 + J[0, 2] * e2)
    f1 = pull * (J[1, 0] * e0 + J[1, 1] * e1 + J[1, 2] * e2)
    f2 = pull * (J[2, 0] * e0 + J[2, 1] * e1 + J[2, 2] * e2)
    h0 = J[0, 0] * w0 + J[0, 1] * w1 + J[0, 2] * w2
    h1 = J[1, 0] * w0 + J[1, 1] * w1 + J[1, 2] * w2
    h2 = J[2, 0] * w0 + J[2, 1] * w1 + J[2, 2] * w2
    m0, m1, m2 = magnet[0], magnet[1] + rods[0] * b1, magnet[2] + rods[1] * b2
    t0 = e1 * f2 - e2 * f1 + m1 * b2 - m2 * b1 + h1 * w2 - h2 * w1
    t1 = e2 * f0 - e0 * f2 + m2 * b0 - m0 * b2 + h2 * w0 - h0 * w2
    t2 = e0 * f1 - e1 * f0 + m0 * b1 - m1 * b0 + h0 * w1 - h1 * w0
    out[0] = -0.5 * (u0 * w0 + u1 * w1 + u2 * w2)
    out[1] = 0.5 * (s * w0 + u1 * w2 - u2 * w1)
    out[2] = 0.5 * (s * w1 + u2 * w0 - u0 * w2)
    out[3] = 0.5 * (s * w2 + u0 * w1 - u1 * w0)
    for i in range(3):
        out[4 + i] = inverse[i, 0] * t0 + inverse[i, 1] * t1 + inverse[i, 2] * t2


@numba.njit(cache=True, fastmath=True)
def _trajectories(start, inertia, inverse, magnet, rods, position, field, pull, steps, states):
    k = np.empty((4, 7))
    for n in range(start.shape[0]):
        y = start[n].copy()
        own = (inertia[n], inverse[n], magnet[n], rods[n])
        states[n, 0] = y[:4]
        for i in range(len(steps)):
            h, node = steps[i], 2 * i
            _slope(y, position[node], field[node], pull[node], *own, k[0])
            _slope(y + 0.5 * h * k[0], position[node + 1], field[node + 1], pull[node + 1], *own, k[1])
            _slope(y + 0.5 * h * k[1], position[node + 1], field[node + 1], pull[node + 1], *own, k[2])
            _slope(y + h * k[2], position[node + 2], field[node + 2], pull[node + 2], *own, k[3])
            y += h / 6.0 * (k[0] + 2.0 * (k[1] + k[2]) + k[3])
            y[:4] /= np.sqrt(np.sum(y[:4] ** 2))
            states[n, i + 1] = y[:4]
