"""Sigmas over arc length and sampling interval from one forward run: what samples tell adds up."""

from dataclasses import dataclass

import numpy as np

from fitting.measurements.groups import columns_of, of_groups
from fitting.sensitivity.information import Known, Quoted
from fitting.sensitivity.sums import Sigmas, sigmas_of
from fitting.sensitivity.vantage import Vantage

MOST_INTERVALS = 8
LEAST_READINGS = 4
"""Of the most frequent channel over the whole arc, below which no longer interval is tried."""


@dataclass(frozen=True)
class SamplingMap:
    """Arcs all begin at the first sample; every k-th reading of each channel is used."""

    arcs_s: np.ndarray
    """[arcs]"""
    every: np.ndarray
    """[intervals] k."""
    intervals_s: np.ndarray
    """[intervals] median spacing of the most frequent channel."""
    samples: np.ndarray
    """[arcs intervals] times at which anything is used."""
    sigmas: Sigmas
    """[arcs intervals ...]"""


def sampling_map(vantage: Vantage, found: Known, told: Quoted, *, arcs: int = 12) -> SamplingMap:
    """Of arcs of equal steps up to the whole, and intervals from that of the readings on, doubled."""
    groups, t = vantage.problem.groups, vantage.samples.t
    used = of_groups(np.asarray(found.weight), groups) > 0.0
    most = int(used.sum(axis=0).max())
    every = 2 ** np.arange(MOST_INTERVALS)
    every = every[most // every >= LEAST_READINGS] if most >= LEAST_READINGS else every[:1]
    ends = np.linspace(0.0, float(t[-1] - t[0]), arcs + 1)[1:]
    part = np.minimum(np.searchsorted(ends, t - t[0] - 1e-9), arcs - 1)
    J = np.concatenate([found.jacobian, found.jacobian_considered], axis=-1)
    turn = np.concatenate([found.turn_by_free, found.turn_of_motion], axis=-1)
    size = J.shape[-1]
    G, M, counts = (np.zeros((arcs, len(every), *shape)) for shape in ((size, size), (size, size), ()))
    for column, k in enumerate(every):
        weight = found.weight * _kept(used, groups, int(k))
        for number in range(arcs):
            own = part == number
            G[number, column] = np.einsum("scu,sc,scv->uv", J[own], weight[own], J[own], optimize=True)
            M[number, column] = np.einsum("sku,skv->uv", turn[own], turn[own], optimize=True)
            counts[number, column] = (weight[own] > 0.0).any(axis=1).sum()
    inside = np.cumsum(np.bincount(part, minlength=arcs))
    sigmas = sigmas_of(
        np.cumsum(G, axis=0),
        np.cumsum(M, axis=0),
        np.broadcast_to(inside[:, None], counts.shape),
        found.prior,
        told.slopes,
    )
    spacing = min(float(np.median(np.diff(t[own]))) for own in used.T if own.sum() > 1)
    return SamplingMap(ends, every, every * spacing, np.cumsum(counts, axis=0), sigmas)


def _kept(used: np.ndarray, groups: tuple, every: int) -> np.ndarray:
    """[samples channels] 1 for every so many readings of each channel."""
    found = np.zeros((len(used), sum(group.width for group in groups)))
    for number, columns in enumerate(columns_of(groups)):
        found[np.flatnonzero(used[:, number])[::every], columns] = 1.0
    return found
