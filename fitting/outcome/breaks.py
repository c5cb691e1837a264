"""From when on one constant change of a sensor, its turn or its bias, explains what residuals are left.

A sensor that was moved, a station that turned, a magnet that was switched on: a fit before it is right and after it is
wrong, and the residuals say when. Least squares of bias and turn behind every candidate time, by running sums.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.outcome.result import Break

FEWEST = 12
"""Samples on either side of a break."""
REMARKABLE = 60.0
"""Saving of chi2 beyond which a break is told, and no less than `SHARE` of what the samples behind it have."""
SHARE = 0.5
MOST = 3
TURNS = 4
"""Steps from the small turn to the whole one."""


def find_breaks(
    t: np.ndarray, residual: np.ndarray, vector: np.ndarray, sigma: float, to_unit: float
) -> tuple[Break, ...]:
    """Breaks of a sensor of vectors, earliest first.

    `residual` [n 3] is (measured - modelled) over `sigma` in the axes of the sensor, `vector` [n 3] the modelled
    reading in the unit of sigma; outliers are left out by the caller.
    """
    found: list[Break] = []
    begin = 0
    while len(t) - begin >= 2 * FEWEST and len(found) < MOST:
        place = _best(t[begin:], residual[begin:], vector[begin:] / sigma)
        if place is None:
            break
        number, change, saving = place
        first = begin + number
        bias, turn, left = _settled(residual[first:], vector[first:] / sigma, change)
        found.append(
            Break(
                float(t[first]),
                float(np.degrees(turn.magnitude())),
                float(np.linalg.norm(bias) * sigma * to_unit),
                float(saving),
                tuple((np.sqrt((left**2).mean(axis=0)) * sigma * to_unit).tolist()),
            )
        )
        residual, vector = residual.copy(), vector.copy()
        residual[first:], vector[first:] = left, turn.apply(vector[first:]) + bias * sigma
        begin = first
    return tuple(found)


def _settled(residual: np.ndarray, vector: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, Rotation, np.ndarray]:
    """Bias [sigma], turn and what they leave of residuals, by Gauss's method from a small turn on."""
    bias, turn = change[:3], Rotation.from_rotvec(change[3:])
    for _ in range(TURNS):
        turned = turn.apply(vector)
        design, left = _design(turned), residual + vector - turned - bias
        normal = np.einsum("nij,nik->jk", design, design)
        normal += 1e-9 * np.trace(normal) * np.eye(6)
        step = np.linalg.solve(normal, np.einsum("nij,ni->j", design, left))
        bias, turn = bias + step[:3], Rotation.from_rotvec(step[3:]) * turn
    return bias, turn, residual + vector - turn.apply(vector) - bias


def _design(vector: np.ndarray) -> np.ndarray:
    """[n 3 6] change of a reading by a bias [sigma] and by a small turn of the sensor [rad], r x v."""
    x, y, z = vector.T
    zero = np.zeros_like(x)
    turned = np.stack([np.stack([zero, z, -y]), np.stack([-z, zero, x]), np.stack([y, -x, zero])]).transpose(2, 0, 1)
    return np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=2)


def _best(t: np.ndarray, residual: np.ndarray, vector: np.ndarray) -> tuple[int, np.ndarray, float] | None:
    design = _design(vector)
    normal = np.einsum("nij,nik->njk", design, design)[::-1].cumsum(axis=0)[::-1]
    right = np.einsum("nij,ni->nj", design, residual)[::-1].cumsum(axis=0)[::-1]
    square = (residual**2).sum(axis=1)[::-1].cumsum()[::-1]
    places = np.arange(FEWEST, len(t) - FEWEST)
    if len(places) == 0:
        return None
    # A weak prior keeps what the vectors behind a place do not tell from growing.
    matrices = normal[places] + 1e-9 * np.trace(normal[places], axis1=1, axis2=2)[:, None, None] * np.eye(6)
    changes = np.linalg.solve(matrices, right[places][..., None])[..., 0]
    savings = np.einsum("nj,nj->n", changes, right[places])
    best = int(np.argmax(savings))
    if savings[best] < max(REMARKABLE, SHARE * square[places[best]]):
        return None
    return int(places[best]), changes[best], float(savings[best])


def stamp_delay(t: np.ndarray, residual: np.ndarray, modelled: np.ndarray, sigma: float) -> tuple[float, float] | None:
    """By how much stamps look late, and its 1-sigma [s]: what residuals have of the readings' own rate.

    `residual` [n k] is (measured - modelled) over sigma, `modelled` [n k] in the unit of sigma. None where the readings
    hardly change.
    """
    if len(t) < FEWEST:
        return None
    rate = np.gradient(modelled, t, axis=0) / sigma
    information = float((rate**2).sum())
    if not information > 1e-12:
        return None
    # A stamp late by d has the reading of d before it: measured - modelled = -d rate.
    noise = max(float(np.sqrt((residual**2).mean())), 1.0)
    return -float((rate * residual).sum()) / information, noise / np.sqrt(information)
