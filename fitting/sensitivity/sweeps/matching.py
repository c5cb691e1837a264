"""The share of an output's variance that some inputs settle, from independent random cases: each beside its neighbours.

With the inputs u kept and all others drawn anew, an output Y becomes Y', and

    V(E[Y|u]) / V(Y) = Cov(Y, Y') / V(Y)            (Sobol 1993; as Janon et al. 2014 estimate it).

Cases of a sweep have no such partners. The nearest case in u stands for one (by rank for one input: Gamboa, Gremaud,
Klein & Lagnoux 2022; by distance for several: Broto, Bachoc & Depecker 2020): its u is off by the distance. That is
mended by a sum of polynomials g, as matching is in Abadie & Imbens 2011: of a case c with its neighbour n

    Y'_c = Y_n - g(u_n, others_n) + g(u_c, others_n),

so that only what g leaves over is wrong by the distance. Whatever g is, the estimate tends to the truth as cases
become many.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from fitting.sensitivity.sweeps.polynomials import PolynomialModel

NEIGHBOURS = 4
_TREE = 8
"""Columns up to which a tree is faster than all distances."""
_ROWS = 1000
"""Of the table of all distances at once."""


@dataclass(frozen=True)
class ClosedIndex:
    """Cov(Y, Y')/V(Y) over pairs of cases, and what each pair adds to its error."""

    value: float
    first: np.ndarray
    """Case of each pair [pairs]."""
    second: np.ndarray
    """Its neighbour [pairs]."""
    influence: np.ndarray
    """[pairs]: `value` is off by the mean of these."""

    @property
    def sigma(self) -> float:
        """1-sigma of `value`."""
        return _sigma(self.first, self.second, self.influence, len(self.influence))

    def sigma_of_difference(self, other: "ClosedIndex") -> float:
        """1-sigma of the difference of two values of the same cases."""
        first = np.concatenate([self.first, other.first])
        second = np.concatenate([self.second, other.second])
        # Both are means over as many pairs.
        return _sigma(first, second, np.concatenate([self.influence, -other.influence]), len(self.influence))


def closed_index(
    u: np.ndarray, output: np.ndarray, kept: list[int], model: PolynomialModel, scale: np.ndarray
) -> ClosedIndex:
    """Share of the variance of an output [cases] that the `kept` columns of the quantiles [cases columns] settle.

    `scale` [columns] is how much a distance in each column counts.
    """
    near = nearest((u * scale)[:, kept], NEIGHBOURS)
    first, second = np.repeat(np.arange(len(u)), NEIGHBOURS), near.ravel()
    mixed = u[second]
    mixed[:, kept] = u[first][:, kept]
    a = output[first]
    b = output[second] - model.foretold[second] + model.at(mixed, model.fold[second])
    middle = 0.5 * (a.mean() + b.mean())
    a, b = a - middle, b - middle
    spread = 0.5 * (a * a + b * b)
    variance = spread.mean()
    value = float((a * b).mean() / variance)
    return ClosedIndex(value, first, second, (a * b - value * spread) / variance)


def nearest(points: np.ndarray, count: int) -> np.ndarray:
    """Numbers of the nearest other points to each [points, count]."""
    if points.shape[1] <= _TREE:
        found = np.asarray(KDTree(points).query(points, k=count + 1)[1])
        own = found == np.arange(len(points))[:, None]
        # Itself is not always the first, and of many equal ones not always there.
        own[~own.any(axis=1), -1] = True
        return found[~own].reshape(len(points), count)
    length, found = np.sum(points**2, axis=1), np.empty((len(points), count), int)
    for begin in range(0, len(points), _ROWS):
        rows = np.arange(begin, min(begin + _ROWS, len(points)))
        distance = length[None] - 2.0 * points[rows] @ points.T
        distance[np.arange(len(rows)), rows] = np.inf
        found[rows] = np.argpartition(distance, count, axis=1)[:, :count]
    return found


def _sigma(first: np.ndarray, second: np.ndarray, influence: np.ndarray, count: int) -> float:
    """1-sigma of a mean over pairs, which depend on each other where they share a case (Fafchamps & Gubert 2007)."""
    cases = int(max(first.max(), second.max())) + 1
    of_case = np.bincount(first, influence, cases) + np.bincount(second, influence, cases)
    # Two entries of one pair of cases share both, and have been counted twice.
    low, high = np.minimum(first, second).astype(np.int64), np.maximum(first, second).astype(np.int64)
    _, number = np.unique(low * cases + high, return_inverse=True)
    twice = np.bincount(number, influence)
    return float(np.sqrt(max(of_case @ of_case - twice @ twice, 0.0)) / count)
