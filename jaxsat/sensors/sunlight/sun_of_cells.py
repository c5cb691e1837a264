"""The direction of the Sun from the readings of cells of any law. On the host.

The whole sphere is searched, as the readings of few cells may suit several directions; the best one is then refined.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

PLACES, SPACING = 1500, 0.1
"""Directions of the search, and about how far they are apart [rad]."""
EARTHLIGHT = 0.12
"""1-sigma of what the Earth may add to a cell, over the Sun square on it."""
EARTHLIGHT_FLOOR = np.radians(10.0)
"""No direction of cells that see the Earth is better known than this [rad]."""
WIDEST = np.radians(45.0)
"""A direction known worse than this is none [rad]."""
ANSWERS, ELSEWHERE = 6, 0.15
"""So many of the best directions are refined, each farther than this from the others [rad]."""
BLOCK, STEPS = 128, 16

Cells = Callable[[Float[np.ndarray, "... 3"]], Float[np.ndarray, "... cells"]]
"""Readings over full ones for unit vectors to the Sun, body axes; without noise and earthlight."""


def sun_of_cells(
    relative: Float[np.ndarray, "n cells"],
    sigma: Float[np.ndarray, " cells"],
    cells: Cells,
    looks: Float[np.ndarray, "cells 3"],
    *,
    earthlight: bool,
    dimming: float = 0.0,
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Unit vectors to the Sun and their 1-sigma angles [rad] from readings over full ones, with errors `sigma`.

    NaN cells are left out; `looks` are the directions in which the cells look. `dimming` is the 1-sigma of how much
    less than the Sun's light all cells show alike, as panels do while the battery is full. NaN where the cells see no
    Sun, where what they see suits no direction, and where it leaves more than `WIDEST` open.
    """
    sky, error = fibonacci_sphere(PLACES), np.hypot(sigma, EARTHLIGHT if earthlight else 0.0)
    found, angles = np.full((len(relative), 3), np.nan), np.full(len(relative), np.nan)
    least = np.maximum(5.0 * sigma, 0.25 if earthlight else 0.05)
    known = np.isfinite(relative)
    lit = np.flatnonzero((np.where(known, relative, 0.0) > least).any(axis=1) & (known.sum(axis=1) >= 2))
    # By blocks, which stay in the cache.
    for rows in np.split(lit, range(BLOCK, len(lit), BLOCK)) if len(lit) else ():
        search = _Search(np.where(known[rows], relative[rows], 0.0), known[rows], error, cells, looks, dimming)
        found[rows], angles[rows] = search.result(sky)
    angles = np.where(angles < WIDEST, np.maximum(angles, EARTHLIGHT_FLOOR if earthlight else 0.0), np.nan)
    return np.where(np.isfinite(angles)[:, None], found, np.nan), angles


def fibonacci_sphere(count: int) -> Float[np.ndarray, "count 3"]:
    """Unit vectors spread evenly over the sphere (Gonzalez 2010)."""
    k = np.arange(count) + 0.5
    z, longitude = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(longitude), across * np.sin(longitude), z], axis=1)


class _Search:
    def __init__(self, read, known, error, cells: Cells, looks, dimming: float):
        self.read, self.known, self.error, self.dimming = read, known, error, dimming
        self.cells, self.looks = cells, looks

    def result(self, sky):
        """Best directions [n 3] and their angles [n], NaN where nothing fits."""
        cost, share = self._over(sky)
        starts, left = [], cost
        for _ in range(ANSWERS):
            starts.append(np.argmin(left, axis=1))
            left = np.where(sky[starts[-1]] @ sky.T > np.cos(ELSEWHERE), np.inf, left)
        start, rows = np.stack(starts, axis=1), np.arange(len(cost))
        answers = self._each(sky[start], np.take_along_axis(share, start, axis=1))
        best, _, _ = _first(answers)
        other = self._each(self._mirrored(best)[:, None], np.ones((len(rows), 1)))
        places, chi_squares, slopes = (np.concatenate(pair, axis=1) for pair in zip(answers, other, strict=True))
        best, least, own = _first((places, chi_squares, slopes))
        # Square on a cell its cosine is flat: there the slopes promise less than the search has found.
        own = np.minimum(own, np.sqrt(0.5 * np.sum(_chances(cost) * _apart(best, sky[None]) ** 2, axis=1)))
        # Of two answers that suit as well either may be the true one.
        ratio = np.exp(-0.5 * (chi_squares - least[:, None]))
        others = np.sqrt(0.5 * np.max(ratio * _apart(best, places) ** 2, axis=1))
        angles = np.hypot(own, others)
        return best, np.where(least < 9.0 + 4.0 * np.sum(self.known, axis=1), angles, np.nan)

    def _each(self, sun, share):
        """`refined` from several starts [n k 3] a row."""
        count, many = sun.shape[1], np.repeat(np.arange(len(sun)), sun.shape[1])
        search = _Search(self.read[many], self.known[many], self.error, self.cells, self.looks, self.dimming)
        found = search.refined(sun.reshape(-1, 3), share.reshape(-1))
        return tuple(x.reshape(len(sun), count, *x.shape[1:]) for x in found)

    def _mirrored(self, sun):
        """On the other side of the plane of the two brightest cells, which see the Sun alike there."""
        two = np.argsort(np.where(self.known, self.read, -np.inf), axis=1)[:, -2:]
        normal = np.cross(self.looks[two[:, 0]], self.looks[two[:, 1]])
        square = np.maximum(np.sum(normal**2, axis=1), 1e-12)
        return sun - (2.0 * np.sum(sun * normal, axis=1) / square)[:, None] * normal

    def _over(self, sky):
        """Chi-square of each direction, and the share of light that suits it best."""
        # As wide as the directions are apart, so that none lies between them unseen.
        weights = self.known / (self.error**2 + SPACING**2)
        model, share = self.cells(sky), np.ones((len(self.read), len(sky)))
        squares = weights @ (model**2).T
        products = (weights * self.read) @ model.T
        if self.dimming > 0.0:
            share = np.clip((products + self.dimming**-2) / (squares + self.dimming**-2), 0.0, 1.0)
        cost = np.sum(weights * self.read**2, axis=1)[:, None] - 2.0 * share * products + share**2 * squares
        return cost + self._prior(share) ** 2, share

    def _prior(self, share):
        return (1.0 - share) / self.dimming if self.dimming > 0.0 else np.zeros_like(share)

    def _errors(self, sun, share):
        """Readings minus model over their errors, and the prior of the share [n cells+1]."""
        apart = np.where(self.known, self.read - share[:, None] * self.cells(sun), 0.0) / self.error
        return np.concatenate([apart, self._prior(share)[:, None]], axis=1)

    def refined(self, sun, share):
        """Levenberg's method on the sphere: directions, chi-square, 1-sigma angles by the slopes."""
        damping = np.full(len(sun), 1e-2)
        errors = self._errors(sun, share)
        for _ in range(STEPS):
            slopes = self._slopes(sun, share)
            normal = slopes.transpose(0, 2, 1) @ slopes
            # In the size of the slopes, whatever the errors are.
            normal += ((damping * np.trace(normal, axis1=1, axis2=2) + 1e-9)[:, None, None]) * np.eye(3)
            step = -np.linalg.solve(normal, (slopes.transpose(0, 2, 1) @ errors[..., None]))[..., 0]
            trial = _moved(sun, step[:, :2]), np.clip(share + step[:, 2], 0.0, 1.0)
            tried = self._errors(*trial)
            better = np.sum(tried**2, axis=1) < np.sum(errors**2, axis=1)
            sun, share = np.where(better[:, None], trial[0], sun), np.where(better, trial[1], share)
            errors = np.where(better[:, None], tried, errors)
            damping *= np.where(better, 0.1, 10.0)
        slopes = self._slopes(sun, share)
        # Enough to invert where the readings leave a direction open.
        normal = slopes.transpose(0, 2, 1) @ slopes + 1e-3 * np.eye(3)
        covariance = np.linalg.inv(normal)
        return sun, np.sum(errors**2, axis=1), np.sqrt(0.5 * (covariance[:, 0, 0] + covariance[:, 1, 1]))

    def _slopes(self, sun, share):
        """Derivatives of the errors by two turns and, where it is not known, the share [n cells+1 3]."""
        small, columns = 1e-5, []
        for turn in np.eye(2) * small:
            turns = np.broadcast_to(turn, (len(sun), 2))
            ahead, behind = self._errors(_moved(sun, turns), share), self._errors(_moved(sun, -turns), share)
            columns.append((ahead - behind) / (2.0 * small))
        by_share = np.zeros_like(columns[0])
        if self.dimming > 0.0:
            by_share[:, :-1] = np.where(self.known, -self.cells(sun) / self.error, 0.0)
            by_share[:, -1] = -1.0 / self.dimming
        return np.stack([*columns, by_share], axis=-1)


def _first(answers):
    """Of several answers to each reading the one that suits it best."""
    rows, first = np.arange(len(answers[1])), np.argmin(answers[1], axis=1)
    return tuple(x[rows, first] for x in answers)


def _chances(chi_squares):
    chances = np.exp(-0.5 * (chi_squares - chi_squares.min(axis=1, keepdims=True)))
    return chances / np.sum(chances, axis=1, keepdims=True)


def _apart(best, places):
    """Angles [n k] of places [n or 1, k, 3] from directions [n 3]."""
    return np.arccos(np.clip(np.sum(best[:, None] * places, axis=-1), -1.0, 1.0))


def _moved(sun, turns):
    """Directions moved by [n 2] small angles along two directions across each."""
    helper = np.eye(3)[np.argmin(np.abs(sun), axis=1)]
    first = np.cross(sun, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    moved = sun + turns[:, :1] * first + turns[:, 1:] * np.cross(sun, first)
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)
