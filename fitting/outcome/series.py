"""One series of residuals: its size, its mean, and whether neighbours agree beyond chance."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

LAGS = 10
"""Longest lag of the portmanteau test [samples]; a fifth of the residuals where they are few."""
FEWEST = 5
"""Residuals of a panel below which it has no correlation."""


@dataclass(frozen=True)
class PanelResiduals:
    """Whitened residuals, (measured - modelled) / sigma, of one panel."""

    count: int
    """Residuals used."""
    rms: float | None
    """[sigma]; 1 where the stated noise is that of the data. None here and below where there are too few residuals."""
    rms_z: float | None
    """Deviation of their sum of squares from `count`, in its own sigmas, sqrt(2 count)."""
    mean: float | None
    """[sigma]"""
    mean_z: float | None
    """The mean in its own sigmas, 1 / sqrt(count)."""
    lag1: float | None
    """Correlation of neighbouring residuals, about their mean."""
    lag1_z: float | None
    """The same in sigmas of white noise."""
    ljung_box_p: float | None
    """Probability that white noise has correlations as large at lags 1 to `lags`."""
    lags: int


def panel_residuals(residual: np.ndarray, slot: np.ndarray) -> PanelResiduals:
    """Diagnostics of one series: `residual` [n] in sigmas at the whole-numbered times `slot` [n], rising, with gaps.

    The correlation at lag k is r_k = sum over the m_k pairs that are k apart of z_i z_j, over the sum of squares, and
    Q = n (n + 2) sum_k r_k^2 / m_k is chi-square with `lags` degrees of freedom for white noise: without gaps, where
    m_k = n - k, the statistic of Ljung & Box 1978. Var r_k = m_k / (n (n + 2)) holds for any set of pairs, since
    z / |z| of normal residuals is uniform on a sphere.
    """
    n = len(residual)
    if n == 0:
        return PanelResiduals(0, None, None, None, None, None, None, None, 0)
    mean, square = float(residual.mean()), float(residual @ residual)
    size = (n, float(np.sqrt(square / n)), (square - n) / float(np.sqrt(2.0 * n)), mean, mean * float(np.sqrt(n)))
    z = residual - mean
    # Where all residuals are equal there is no correlation, only rounding over rounding.
    if n < FEWEST or not z @ z > 1e-20 * square:
        return PanelResiduals(*size, None, None, None, 0)
    series = np.zeros(slot[-1] - slot[0] + 1)
    present = np.zeros(len(series))
    series[slot - slot[0]], present[slot - slot[0]] = z, 1.0
    lags = range(1, min(LAGS, n // FEWEST, len(series) - 1) + 1)
    pairs = np.array([present[k:] @ present[:-k] for k in lags])
    correlation = np.array([series[k:] @ series[:-k] for k in lags]) / (z @ z)
    # In sigmas of white noise; a lag without a pair says nothing.
    score = correlation * np.sqrt(n * (n + 2.0) / np.maximum(pairs, 1.0))
    seen = int((pairs > 0).sum())
    p = float(chdtrc(seen, score @ score)) if seen else None
    first = (float(correlation[0]), float(score[0])) if pairs[0] else (None, None)
    return PanelResiduals(*size, *first, p, len(lags))


def slots(t_s: np.ndarray) -> np.ndarray:
    """Whole-numbered times, so that samples are neighbours where they are one usual interval apart and no more."""
    if len(t_s) < 2:
        return np.zeros(len(t_s), int)
    # Rounded interval by interval: an interval a little off the median must not add up to a slot.
    steps = np.maximum(np.rint(np.diff(t_s) / np.median(np.diff(t_s))), 1.0)
    return np.concatenate([[0], np.cumsum(steps)]).astype(int)
