"""Sobol indices of an output by random inputs, from independent random cases of both, each with its sampling error.

The first-order index of an input is the share of the variance that it settles alone, the total index what is left
open where all inputs but it are known (Sobol 1993; Homma & Saltelli 1996): first <= total, and the difference is what
it does together with others. An input may be a vector, as an attitude: its numbers go together, as one input, so they
may depend on each other. Inputs must not.

Where all other inputs are hardly known from neighbours, as there are many or the output jumps, the total index is too
large, by at most what is unresolved: what is left open where all inputs are known (an output without noise: nothing).
An input that does nothing shows as much (the dummy input of Zadeh et al. 2017). It is taken off the lower end; `value`
counts it as noise, which every input shares in the same measure. With noise in the loop it is the noise's share too.
Where more than a fifth is unresolved, there is no `value` of the total index: only its interval. A first-order index of
a vector of many numbers may likewise be too small, by less: its upper end says so.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.stats import norm, rankdata

from fitting.sensitivity.sweeps.matching import ClosedIndex, closed_index
from fitting.sensitivity.sweeps.polynomials import fit_polynomials, quantiles

FEWEST, MOST = 200, 10_000
"""Cases that an index takes, and of which so many are used: twice as many take four times as long."""
RAREST = 30
"""Cases that must have the rarer of two values."""
DIM = 0.2
"""Unresolved share beyond which a total index has no value."""
HEAVY = 0.05
"""Share of the variance that one case may make."""
_NEAR = 0.003
"""Share of a column in the variance, over the largest of them, below which all count alike in a distance."""
_JITTER = 1e-7
"""By which equal values are told apart, at random: else all would have the same neighbours."""
_95 = float(norm.ppf(0.975))


@dataclass(frozen=True)
class Estimate:
    """A number and its 95 % interval."""

    value: float
    """NaN of a total index of which an interval is all that is known."""
    low: float
    high: float


@dataclass(frozen=True)
class Indices:
    """Of one output by one input."""

    first: Estimate
    total: Estimate
    slopes: dict[str, tuple[float, float]]
    """Of each column: change of the output by one unit of it, and 1-sigma: least squares on all columns together.

    Of independent normal inputs it is the mean derivative (Stein 1981)."""
    steepness: dict[str, float]
    """Of each column: root mean square derivative of the sum of polynomials, in units of the output, by the quantile
    of the input, which goes from 0 to 1: the derivative-based measure of Sobol & Kucherenko 2009."""
    bound: float | None
    """Of the total index, as far as the polynomials tell: mean square derivative over pi^2 and the variance (Sobol &
    Kucherenko 2009, Lamboni et al. 2013, of a uniform input); None of an input of several columns."""


@dataclass(frozen=True)
class OutputIndices:
    """Of one output by all inputs."""

    cases: int
    """That were used."""
    mean: float
    sigma: float
    """Standard deviation."""
    foretold: float
    """Share of the variance that polynomials of the inputs foretell of cases that they have not seen."""
    unresolved: float
    """Share of it that is left open where all inputs are as those of the nearest cases."""
    inputs: dict[str, Indices]
    """Empty where there are none: `remarks` say why."""
    remarks: tuple[str, ...] = ()


def sobol_indices(
    inputs: Mapping[str, np.ndarray], output: np.ndarray, *, names: Mapping[str, tuple[str, ...]] | None = None
) -> OutputIndices:
    """Indices of an output [cases] by inputs, [cases] or [cases columns] each; `names` are those of their columns.

    Only cases whose output is finite count. Where no index can be told `inputs` is empty and `remarks` say why. Raises
    ValueError for inputs that are not finite or of another number of cases. `scipy.stats.sobol_indices` needs no
    neighbours, where the output is a function that can be called where one wants.
    """
    columns = {name: np.asarray(values, float).reshape(len(values), -1) for name, values in inputs.items()}
    output = np.asarray(output, float)
    for name, values in columns.items():
        if len(values) != len(output):
            raise ValueError(f"input {name} has {len(values)} cases, the output {len(output)}")
        if not np.isfinite(values).all():
            raise ValueError(f"input {name} has values that are not finite")
    known = np.flatnonzero(np.isfinite(output))[:MOST]
    y, x = output[known], {name: values[known] for name, values in columns.items()}
    reason = _no_indices(y, len(output))
    if reason:
        spread = (float(y.mean()), float(y.std())) if len(y) else (np.nan, np.nan)
        return OutputIndices(len(y), *spread, np.nan, np.nan, {}, (reason,))
    still = [name for name, values in x.items() if np.ptp(values, axis=0).max() == 0.0]
    x = {name: values[:, np.ptp(values, axis=0) > 0.0] for name, values in x.items() if name not in still}
    remarks = [f"{name} does not vary" for name in still]
    heaviest = float(np.max((y - y.mean()) ** 2) / np.sum((y - y.mean()) ** 2))
    if heaviest > HEAVY:
        remarks.append(f"one case makes {heaviest:.0%} of the variance: the intervals are too narrow")
    if not x:
        return OutputIndices(len(y), float(y.mean()), float(y.std()), np.nan, np.nan, {}, tuple(remarks))
    labels = {name: tuple((names or {}).get(name) or _numbered(name, x[name].shape[1])) for name in x}
    labels = {name: _varying(label, columns[name][known]) for name, label in labels.items()}
    return _of_varying(x, y, labels, tuple(remarks))


def _of_varying(x, y, labels, remarks) -> OutputIndices:
    mean, sigma = float(y.mean()), float(y.std())
    rng = np.random.default_rng(0)
    table = np.concatenate(list(x.values()), axis=1)
    u, z = quantiles(table), (y - mean) / sigma
    u = u + _JITTER * rng.uniform(-1.0, 1.0, u.shape)
    model = fit_polynomials(u, z, rng)
    shares = model.shares(u.shape[1])
    # What matters must be near; what is not seen to matter may be farther, and is not forgotten.
    scale = np.sqrt(np.maximum(shares / max(shares.max(), 1e-300), _NEAR))
    everything, begin, places = list(range(u.shape[1])), 0, {}
    for name, values in x.items():
        places[name] = everything[begin : begin + values.shape[1]]
        begin += values.shape[1]
    whole, points = closed_index(u, z, everything, model, scale), u * scale
    slopes, slope_sigmas = _slopes(table, y)
    steep = sigma * np.sqrt(model.mean_square_slopes(u))
    found = {}
    for name, own in places.items():
        first = closed_index(u, z, own, model, scale)
        others = [column for column in everything if column not in own]
        lowest, highest = first.value - _95 * first.sigma, first.value + _95 * first.sigma
        if others:
            total = _total(closed_index(u, z, others, model, scale), whole, lowest)
        else:
            # The only input: what it does not settle is noise.
            total = Estimate(*(float(np.clip(end, 0.0, 1.0)) for end in (first.value, lowest, highest)))
        lost = 0.0
        if others and len(own) > 1:
            # Neighbours in a few columns are nearer than those in all. What is unresolved falls as the square of the
            # distance, where the output jumps as the distance, and is here taken to fall as its root.
            nearer = min(_apart(points[:, own], first) / max(_apart(points[:, own], whole), 1e-300), 1.0)
            lost = max(1.0 - whole.value, 0.0) * nearer**0.5
        alone = Estimate(first.value, lowest, max(highest, min(highest + lost, total.high)))
        found[name] = Indices(
            alone,
            total,
            {label: (slopes[k], slope_sigmas[k]) for label, k in zip(labels[name], own, strict=True)},
            {label: float(steep[k]) for label, k in zip(labels[name], own, strict=True)},
            float((steep[own[0]] / sigma) ** 2 / np.pi**2) if len(own) == 1 else None,
        )
    foretold = 1.0 - float(np.mean((z - model.foretold) ** 2))
    return OutputIndices(len(y), mean, sigma, foretold, 1.0 - whole.value, found, remarks)


def _apart(points: np.ndarray, pairs: ClosedIndex) -> float:
    """Mean distance of cases from their neighbours."""
    return float(np.mean(np.linalg.norm(points[pairs.first] - points[pairs.second], axis=1)))


def _total(others: ClosedIndex, whole: ClosedIndex, lowest: float) -> Estimate:
    """From what all other inputs settle, and all inputs; it is no less than the first-order index is at its lowest."""
    left, unresolved = 1.0 - others.value, 1.0 - whole.value
    low = float(np.clip(max(left - unresolved - _95 * others.sigma_of_difference(whole), lowest), 0.0, 1.0))
    high = float(np.clip(left + _95 * others.sigma, low, 1.0))
    if unresolved > DIM:
        return Estimate(np.nan, low, high)
    return Estimate(float(np.clip((left - unresolved) / (1.0 - unresolved), low, high)), low, high)


def _no_indices(y: np.ndarray, cases: int) -> str:
    if len(y) < FEWEST:
        return f"{len(y)} of {cases} cases have it; {FEWEST} are needed"
    if np.ptp(y) <= 1e-12 * np.max(np.abs(y)):
        return f"constant: {y[0]:.6g} in all cases"
    values, counts = np.unique(y, return_counts=True)
    if len(values) == 2 and counts.min() < RAREST:
        return f"all but {counts.min()} cases alike; {RAREST} are needed"
    return ""


def _slopes(table: np.ndarray, y: np.ndarray) -> tuple[list[float], list[float]]:
    """Least squares on all columns and their constant, with errors of a scatter that may differ (White 1980)."""
    centred = table - table.mean(axis=0)
    size = centred.std(axis=0)
    design = centred / size
    inverse = np.linalg.pinv(design.T @ design)
    slope = inverse @ (design.T @ (y - y.mean()))
    left = y - y.mean() - design @ slope
    sigma = np.sqrt(np.diagonal(inverse @ ((design * left[:, None] ** 2).T @ design) @ inverse))
    return (slope / size).tolist(), (sigma / size).tolist()


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return (name,) if count == 1 else tuple(f"{name}[{k}]" for k in range(count))


def _varying(label: tuple[str, ...], values: np.ndarray) -> tuple[str, ...]:
    varies = np.ptp(values, axis=0) > 0.0
    return label if len(label) == varies.sum() else tuple(np.array(label)[varies])


@dataclass(frozen=True)
class Dependence:
    """Two inputs that are not independent."""

    inputs: tuple[str, str]
    correlation: float
    """Of ranks, the largest of any of their columns."""


def dependences(inputs: Mapping[str, np.ndarray], *, level: float = 0.001) -> list[Dependence]:
    """Pairs of inputs, [cases] or [cases columns], with a rank correlation that chance makes in `level` of all tables.

    Sobol's decomposition is of independent inputs: with others the indices of either have part of the other's in them.
    What does not show as a correlation of ranks, as of a number with its square, is not found.
    """
    columns = {name: np.asarray(values, float).reshape(len(values), -1) for name, values in inputs.items()}
    columns = {name: values[:, np.ptp(values, axis=0) > 0.0] for name, values in columns.items()}
    columns = {name: values for name, values in columns.items() if values.shape[1]}
    if len(columns) < 2:
        return []
    table = np.concatenate(list(columns.values()), axis=1)
    owner = np.repeat(np.arange(len(columns)), [values.shape[1] for values in columns.values()])
    # Of ranks, equal values with their mean rank: Spearman's.
    correlation = np.corrcoef(rankdata(table, axis=0), rowvar=False)
    tried = int(np.sum(owner[:, None] < owner[None]))
    # Of ranks of independent columns: normal with 1/sqrt(n - 1); Bonferroni's correction.
    limit = norm.isf(0.5 * level / tried) / np.sqrt(len(table) - 1.0)
    result = []
    for (a, first), (b, second) in combinations(enumerate(columns), 2):
        part = correlation[np.ix_(owner == a, owner == b)].ravel()
        largest = float(part[np.argmax(np.abs(part))])
        if abs(largest) > limit:
            result.append(Dependence((first, second), largest))
    return result
