"""Calibration of a magnetometer by the modulus of the field alone, which no attitude changes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import least_squares

from jaxsat.errors import InputError

NAMES = ("bias.x", "bias.y", "bias.z", "scale.x", "scale.y", "scale.z", "shear.x", "shear.y", "shear.z")
"""Order of the covariance. Shears are the entries yz, xz, xy of the symmetric matrix."""
ROUNDS = 6
OUTLIER = 4.5
"""Readings whose modulus is off by more, in robust standard deviations, are left out."""
UNSEEN = 1e-10
"""Share of the scaled information below which a combination of the unknowns is not seen."""


@dataclass(frozen=True)
class MagnetometerCalibration:
    """Bias, scale and shear as `jaxsat.sensors.Magnetometer` takes them."""

    bias: Float[np.ndarray, "3"]
    """[T]"""
    scale: Float[np.ndarray, "3"]
    shear: Float[np.ndarray, "3"]
    """Entries yz, xz, xy."""
    covariance: Float[np.ndarray, "9 9"]
    """In the order of `NAMES`; infinite on the diagonal for what the readings do not see."""
    sigma: float
    """Noise of an axis: the one given, or what the moduli scatter by [T]."""
    residual: Float[np.ndarray, " n"]
    """Modulus of each calibrated reading less that of the field [T]."""
    used: Bool[np.ndarray, " n"]
    """Readings that were fitted: finite ones that are no outliers."""

    @property
    def matrix(self) -> Float[np.ndarray, "3 3"]:
        """Symmetric: reading = matrix @ field + bias."""
        return _matrix(np.concatenate([self.bias, self.scale, self.shear]))

    @property
    def sigmas(self) -> dict[str, float]:
        """1-sigma of each number by `NAMES`, SI."""
        return dict(zip(NAMES, np.sqrt(np.diagonal(self.covariance)).tolist(), strict=True))

    def corrected(self, readings: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """The field in the sensor's axes [T]."""
        return (readings - self.bias) @ np.linalg.inv(self.matrix)


def calibrate_magnetometer(
    readings: Float[np.ndarray, "n 3"],
    modulus: Float[np.ndarray, " n"],
    *,
    sigma: float | None = None,
    bias_only: bool = False,
) -> MagnetometerCalibration:
    """Bias, scale and shear of least squares of |M^-1 (reading - bias)| - |B|, robust against outliers.

    `modulus` is |B| of a field model at the readings [T]; `sigma` the noise of an axis [T], by default what the moduli
    scatter by. Rows with a NaN are not used. A start by the centred equation linear in the bias, then Gauss-Newton on
    the moduli (the two steps of Alonso & Shuster 2002, here with weights of Cauchy's law), then least squares without
    outliers, whose inverse information is the covariance. A turn of the sensor leaves |B| as it is and cannot be seen:
    M is symmetric. `bias_only` keeps M = 1, for readings of few directions.

    Raises `InputError` where fewer readings are there than unknowns.
    """
    good = np.isfinite(readings).all(axis=1) & np.isfinite(modulus) & (modulus > 0.0)
    free = np.arange(9) < (3 if bias_only else 9)
    if good.sum() <= free.sum():
        raise InputError(f"{good.sum()} readings of a magnetometer, and a calibration needs more than {free.sum()}")
    read, field = readings[good], modulus[good]
    # In units of the field, all unknowns are of order one.
    unit = float(np.median(field))
    start = np.concatenate([_start(read / unit, field / unit), _IDEAL[3:]])
    x = _fitted(read / unit, field / unit, start, free, "cauchy")
    noise, kept = 0.0, np.ones(len(read), bool)
    for _ in range(ROUNDS):
        off = _residual(x, read / unit, field / unit, noise)
        before, kept = kept, np.abs(off) < OUTLIER * max(_spread(off), 1e-12)
        if kept.sum() <= free.sum():
            kept = before
        degrees = max(int(kept.sum() - free.sum()), 1)
        x = _fitted(read[kept] / unit, field[kept] / unit, x, free, "linear", noise)
        scatter = np.sqrt(np.sum(_residual(x, read[kept] / unit, field[kept] / unit, noise) ** 2) / degrees)
        noise = float(scatter) if sigma is None else sigma / unit
        if np.array_equal(kept, before):
            break
    x = _fitted(read[kept] / unit, field[kept] / unit, x, free, "linear", noise)
    slopes = _slopes(x, read[kept] / unit)[:, free]
    covariance = np.zeros((9, 9))
    covariance[np.ix_(free, free)] = noise**2 * _inverse(slopes.T @ slopes)
    size = np.where(np.arange(9) < 3, unit, 1.0)
    used, residual = np.zeros(len(readings), bool), np.full(len(readings), np.nan)
    used[good] = kept
    residual[good] = unit * _residual(x, read / unit, field / unit, noise)
    return MagnetometerCalibration(
        unit * x[:3], x[3:6], x[6:], covariance * np.outer(size, size), unit * noise, residual, used
    )


_IDEAL = np.repeat([0.0, 1.0, 0.0], 3)
_HOLD = np.repeat([1e-3, 1.0, 1.0], 3)


def _matrix(x):
    yz, xz, xy = x[6:]
    return np.diag(x[3:6]) + np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])


def _residual(x, read, field, noise):
    # Noise across the field lengthens a reading: by its square over the field, of two axes.
    return np.linalg.norm((read - x[:3]) @ np.linalg.inv(_matrix(x)), axis=1) - field - noise**2 / field


def _slopes(x, read):
    """[n 9] derivatives of the moduli."""
    inverse = np.linalg.inv(_matrix(x))
    u = (read - x[:3]) @ inverse
    w = u / np.linalg.norm(u, axis=1, keepdims=True) @ inverse
    crossed = [w[:, a] * u[:, b] + w[:, b] * u[:, a] for a, b in ((1, 2), (0, 2), (0, 1))]
    return -np.column_stack([w, w * u, *crossed])


def _fitted(read, field, x, free, loss, noise=0.0):
    def whole(part):
        y = x.copy()
        y[free] = part
        return y

    scale = max(_spread(_residual(x, read, field, noise)), 1e-9)
    # What no reading sees would drift by rounding: held near an ideal sensor by far less than one reading weighs.
    hold = scale * _HOLD[free]

    def residual(part):
        y = whole(part)
        return np.concatenate([_residual(y, read, field, noise), hold * (y - _IDEAL)[free]])

    def slopes(part):
        return np.vstack([_slopes(whole(part), read)[:, free], np.diag(hold)])

    jac: Any = slopes
    settings: dict[str, Any] = {"loss": loss, "f_scale": scale, **dict.fromkeys(("xtol", "ftol", "gtol"), 1e-14)}
    return whole(least_squares(residual, x[free], jac, **settings).x)


def _start(read, field):
    """Bias by |r|^2 - |B|^2 = 2 r b - |b|^2, linear in b and |b|^2, with weights of Cauchy's law."""
    rows = np.column_stack([2.0 * read, -np.ones(len(read))])
    squares = np.sum(read**2, axis=1) - field**2
    away = np.linalg.norm(read - np.median(read, axis=0), axis=1)
    # A wild reading draws the first solution to itself, and would then pass for a good one.
    weight = np.where(away <= 2.5 * np.median(away), 1.0, 0.0)
    found = np.zeros(4)
    for _ in range(4 * ROUNDS):
        found = np.linalg.lstsq(rows * weight[:, None], squares * weight, rcond=1e-8)[0]
        off = squares - rows @ found
        weight = 1.0 / np.sqrt(1.0 + (off / max(2.0 * _spread(off), 1e-12)) ** 2)
    return found[:3]


def _spread(off):
    """Standard deviation by the median of the moduli, which outliers hardly move."""
    return 1.4826 * float(np.median(np.abs(off)))


def _inverse(information):
    """Inverse with an infinite diagonal for what is not seen."""
    root = np.sqrt(np.diagonal(information))
    # All unknowns are of order one: a slope that is nothing beside the largest is rounding.
    root = np.maximum(root, 1e-5 * np.max(root))
    values, vectors = np.linalg.eigh(information / np.outer(root, root))
    seen = values > UNSEEN * values[-1]
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T / np.outer(root, root)
    blind = np.any(np.abs(vectors[:, ~seen]) > 1e-4, axis=1)
    inverse[blind, :], inverse[:, blind] = 0.0, 0.0
    inverse[blind, blind] = np.inf
    return inverse
