"""A sum of Legendre polynomials of the inputs that comes near an output: what matching leaves over is made small by it.

In the quantile u of each input, from -1 to 1, products of normalised Legendre polynomials are orthonormal (Sobol's
decomposition of such a sum can be read from its coefficients: Sudret 2008). The terms of low degree come first, those
of one input before those of several (the hyperbolic order of Blatman & Sudret 2011), as many as the cases bear. They
are fitted with a ridge that generalised cross-validation chooses (Golub, Heath & Wahba 1979), and five times, each
without a fifth of the cases: a case is foretold by a sum that has not seen it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import rankdata

CASES_A_TERM, MOST_TERMS = 8, 600
FOLDS = 5
_TOGETHER = 12
"""Columns up to which products of three are tried: of more there are too many."""
_BLOCK = 512
"""Points whose terms fit into the processor's cache."""
_RIDGES = np.logspace(-6.0, 1.0, 15)

Term = tuple[tuple[int, int], ...]
"""Columns and the degree in each."""


def quantiles(columns: np.ndarray) -> np.ndarray:
    """Ranks of each column [cases columns], spread evenly over -1 to 1; equal values have their mean rank."""
    return (rankdata(columns, axis=0) - 0.5) / len(columns) * 2.0 - 1.0


@dataclass(frozen=True)
class PolynomialModel:
    """The fitted sums, and what they foretell of the cases that they have not seen."""

    terms: tuple[Term, ...]
    fold: np.ndarray
    """Which sum has not seen a case [cases]."""
    coefficients: np.ndarray
    """[sums, 1 + terms], the constant first."""
    foretold: np.ndarray
    """[cases]"""

    def at(self, u: np.ndarray, fold: np.ndarray) -> np.ndarray:
        """The sum of number `fold` [points] at quantiles [points columns]."""
        found = np.empty(len(u))
        for number in range(FOLDS):
            own = np.flatnonzero(fold == number)
            for begin in range(0, len(own), _BLOCK):
                part = own[begin : begin + _BLOCK]
                found[part] = _basis(self.terms, u[part]) @ self.coefficients[number]
        return found

    def shares(self, columns: int) -> np.ndarray:
        """Variance of the terms that have a column in them, over that of all [columns]."""
        square, found = np.mean(self.coefficients[:, 1:], axis=0) ** 2, np.zeros(columns)
        for term, part in zip(self.terms, square, strict=True):
            for column, _ in term:
                found[column] += part
        return found / max(square.sum(), 1e-300)

    def mean_square_slopes(self, u: np.ndarray) -> np.ndarray:
        """Mean square derivative by the quantile of each column, which goes from 0 to 1 [columns], over cases."""
        mean = np.mean(self.coefficients, axis=0)
        # The quantile from -1 to 1 changes twice as fast.
        begins = range(0, len(u), _BLOCK)
        return np.array(
            [
                4.0 * np.mean(np.concatenate([_basis(self.terms, u[b : b + _BLOCK], by=k) @ mean for b in begins]) ** 2)
                for k in range(u.shape[1])
            ]
        )


def fit_polynomials(u: np.ndarray, output: np.ndarray, rng: np.random.Generator) -> PolynomialModel:
    """Sums that come near an output [cases] of quantiles [cases columns]."""
    cases, columns = u.shape
    terms = _terms(columns, min(MOST_TERMS, cases // CASES_A_TERM))
    basis = _basis(terms, u)
    fold = rng.permutation(cases) % FOLDS
    parts = [basis[fold == number] for number in range(FOLDS)]
    squares = [part.T @ part for part in parts]
    products = [part.T @ output[fold == number] for number, part in enumerate(parts)]
    square, product = np.sum(squares, axis=0), np.sum(products, axis=0)
    ridge = _best_ridge(square, product, float(output @ output), cases)
    # The ridge is one number from all cases; a sum without a fifth of them wants as much less of it.
    coefficients = np.stack(
        [
            _solution(square - squares[number], product - products[number], ridge * (cases - len(part)) / cases)
            for number, part in enumerate(parts)
        ]
    )
    foretold = np.empty(cases)
    for number, part in enumerate(parts):
        foretold[fold == number] = part @ coefficients[number]
    return PolynomialModel(terms, fold, coefficients, foretold)


def _best_ridge(square: np.ndarray, product: np.ndarray, power: float, cases: int) -> float:
    """The ridge of least generalised cross-validation, from sums over the cases."""
    values, vectors = np.linalg.eigh(square)
    values, along = np.maximum(values, 0.0), vectors.T @ product

    def score(ridge):
        kept = values / (values + ridge)
        left = power - np.sum(along**2 / (values + ridge) * (2.0 - kept))
        return left / (1.0 - kept.sum() / cases) ** 2

    return min(_RIDGES * cases, key=score)


def _solution(square: np.ndarray, product: np.ndarray, ridge: float) -> np.ndarray:
    return cho_solve(cho_factor(square + ridge * np.eye(len(square)), lower=True), product)


def _terms(columns: int, count: int) -> tuple[Term, ...]:
    """So many products of lowest order (sum of degree^0.6)^(1/0.6)."""

    def order(*degrees):
        return sum(degree**0.6 for degree in degrees) ** (1.0 / 0.6)

    found: list[tuple[float, Term]] = [(order(p), ((k, p),)) for k in range(columns) for p in range(1, 13)]
    pairs = [(p, q) for p in range(1, 7) for q in range(1, 7)]
    found += [(order(p, q), ((k, p), (j, q))) for k in range(columns) for j in range(k) for p, q in pairs]
    if columns <= _TOGETHER:
        low = [(p, q, r) for p in range(1, 4) for q in range(1, 4) for r in range(1, 4)]
        triples = [(k, j, i) for k in range(columns) for j in range(k) for i in range(j)]
        found += [(order(p, q, r), ((k, p), (j, q), (i, r))) for k, j, i in triples for p, q, r in low]
    found.sort(key=lambda one: one[0])
    return tuple(term for _, term in found[:count])


def _basis(terms: tuple[Term, ...], u: np.ndarray, by: int | None = None) -> np.ndarray:
    """Values [points, 1 + terms] of the constant and the terms, or their derivatives by a column."""
    highest = max((degree for term in terms for _, degree in term), default=0)
    norm = np.sqrt(2.0 * np.arange(highest + 1) + 1.0)
    powers = [legendre.legvander(column, highest) * norm for column in u.T]
    if by is not None:
        slopes = [legendre.legval(u[:, by], legendre.legder(one)) for one in np.diag(norm)]
        powers[by] = np.stack([np.broadcast_to(one, len(u)) for one in slopes], axis=1)
    # Rows are points, but columns are made one by one.
    found = np.zeros((1 + len(terms), len(u)))
    found[0] = 1.0 if by is None else 0.0
    flat = [np.ascontiguousarray(one.T) for one in powers]
    for row, term in enumerate(terms, start=1):
        if by is not None and all(column != by for column, _ in term):
            continue
        (column, degree), *others = term
        found[row] = flat[column][degree]
        for column, degree in others:
            found[row] *= flat[column][degree]
    return found.T
