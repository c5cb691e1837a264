"""What more numbers would save, by residuals and their slopes at a minimum: a look in place of a refit (Rao 1948)."""

from dataclasses import dataclass
from functools import cached_property

import jax
import numpy as np

from fitting.measurements.floor import at_floor

SCALE = 5.0
"""Residual [sigma] beyond which a reading counts linearly."""
_at_floor = jax.jit(at_floor)


def terms(residual: np.ndarray, floor: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Square, slope and curvature of what residuals cost (`at_floor`), by one program in place of thirty operations."""
    square, slope, curvature = (np.asarray(each) for each in _at_floor(residual, floor))
    return square, slope, curvature


def robust(square: np.ndarray) -> np.ndarray:
    """Squares that grow linearly beyond `SCALE`."""
    return 2.0 * square / (1.0 + np.sqrt(1.0 + square / SCALE**2))


def softened(weight: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Weights of readings in the slope of what is `robust`."""
    return weight / np.sqrt(1.0 + square / SCALE**2)


@dataclass(frozen=True)
class Score:
    """A minimum, linearised."""

    residual: np.ndarray
    """[samples channels] in sigmas."""
    jacobian: np.ndarray
    """[samples channels unknowns] of those that are free."""
    weight: np.ndarray
    """[samples channels], that of witnesses included."""
    floor: np.ndarray
    """[samples channels] see `fitting.measurements.floor`."""
    x: np.ndarray
    """[unknowns] of which the priors have the squares, zero where there is no prior."""
    has_prior: np.ndarray
    """[unknowns] bool."""

    @cached_property
    def _terms(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows that count: their number, Jacobian, slope and curvature of half of chi2."""
        square, slope, curvature = terms(self.residual, self.floor)
        used = np.flatnonzero(self.weight.reshape(-1) > 0.0)
        w = softened(self.weight, square).reshape(-1)[used]
        J = self.jacobian.reshape(-1, self.jacobian.shape[-1])[used]
        return used, J, w * slope.reshape(-1)[used], w * curvature.reshape(-1)[used]

    @cached_property
    def _base(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Gradient and curvature by the unknowns, and what a step from here would save of chi2."""
        _, J, slope, curvature = self._terms
        gradient = J.T @ slope + self.x
        H = J.T @ (J * curvature[:, None]) + np.diag(self.has_prior.astype(float))
        return gradient, H, float(gradient @ _solved(H, gradient))

    def fall(self, columns: np.ndarray, *, with_prior: bool) -> tuple[np.ndarray, float]:
        """Sizes of more numbers by whose units residuals change by `columns` [samples channels numbers], and by how
        much chi2 falls with them; `with_prior` where each has a prior of one unit."""
        used, J, slope, curvature = self._terms
        C = columns.reshape(-1, columns.shape[-1])[used]
        gradient, H, saved = self._base
        both = np.concatenate([gradient, C.T @ slope])
        cross = J.T @ (C * curvature[:, None])
        own = C.T @ (C * curvature[:, None]) + (np.eye(C.shape[1]) if with_prior else 0.0)
        step = -_solved(np.block([[H, cross], [cross.T, own]]), both)
        return step[len(gradient) :], float(-both @ step) - saved

    def moved_to(self, residual: np.ndarray) -> float:
        """Chi2, as far as it is not constant, that a step from other residuals [samples channels] would leave."""
        other = Score(residual, self.jacobian, self.weight, self.floor, self.x, self.has_prior)
        used, _, _, _ = other._terms
        square = terms(residual, self.floor)[0].reshape(-1)[used]
        return float((self.weight.reshape(-1)[used] * robust(square)).sum()) - other._base[2]


def _solved(H: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Of curvatures that may be singular: nothing is moved along what nothing tells."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(H), 1e-300))
    return scale * np.linalg.lstsq(scale[:, None] * H * scale, scale * gradient, rcond=1e-10)[0]
