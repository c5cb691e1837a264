"""Whether the residuals of a fit look like the noise that was stated: size, mean, memory and tails, panel by panel.

What the model leaves out (a light that it does not know, a satellite that turns a little differently) shows as a mean
or as neighbouring residuals that agree, long before chi2 shows it.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc, ndtr

from fitting.outcome.result import FitResult
from jaxsat.errors import InputError
from jaxsat.panel_names import PANEL_NAMES

LAGS = 10
"""Longest lag of the portmanteau test [samples]; a fifth of the residuals where they are few."""
FEWEST = 5
"""Residuals of a panel below which it has no correlation."""
TAILS = (2.0, 3.0, 4.0)
"""Residuals beyond these are counted [sigma]."""
REMARKABLE_Z, REMARKABLE_P = 4.0, 1e-3
"""A mean, a size or a memory beyond them is remarked on: among the 18 of a fit, noise makes one in 100 fits or so."""


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


@dataclass(frozen=True)
class Diagnostics:
    """How well residuals and stated noise agree; the fit's own freedom makes all of it look a little better."""

    chi2_per_dof: float | None
    """None without a degree of freedom."""
    chi2_p: float | None
    """Probability that noise of the stated size gives this chi2 or more."""
    panels: dict[str, PanelResiduals]
    """By name, `+x` ... `-z`."""
    tails: dict[str, dict[str, float | int]]
    """For each limit of `TAILS`, as `3`: residuals `found` beyond it, and as many as are `expected` of normal ones."""

    def remarks(self) -> list[str]:
        """Sentences on what is not noise; none where all is well."""
        return [line for name, panel in self.panels.items() for line in _remarks(name, panel)]

    def as_dict(self) -> dict[str, Any]:
        """For JSON: plain numbers, None where there is none."""
        return asdict(self)


def diagnose(result: FitResult, *, noise_mA: float) -> Diagnostics:
    """Diagnostics of all residuals that have a weight; `noise_mA` is the fit's 1-sigma of a current, rounding included.

    Raises `InputError` unless it is above zero.
    """
    if not noise_mA > 0.0:
        raise InputError(f"expected a noise above 0 mA, got {noise_mA:g}", field="noise_mA")
    used = result.weight > 0.0
    residual = (result.measured_mA - result.modelled_mA) / noise_mA
    slot = slots(result.t_s)
    panels = {name: panel_residuals(residual[used[:, k], k], slot[used[:, k]]) for k, name in enumerate(PANEL_NAMES)}
    size, count = np.abs(residual[used]), int(used.sum())
    tails = {
        f"{limit:g}": {"found": int((size > limit).sum()), "expected": round(2.0 * count * float(ndtr(-limit)), 2)}
        for limit in TAILS
    }
    known = result.dof > 0
    return Diagnostics(
        chi2_per_dof=result.chi2 / result.dof if known else None,
        chi2_p=float(chdtrc(result.dof, result.chi2)) if known else None,
        panels=panels,
        tails=tails,
    )


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


def _remarks(name: str, panel: PanelResiduals) -> Iterator[str]:
    if panel.mean is not None and panel.mean_z is not None and abs(panel.mean_z) > REMARKABLE_Z:
        yield f"residuals of {name} have a mean of {panel.mean:+.2f} sigma ({panel.mean_z:+.1f} of its own)"
    if panel.rms is not None and panel.rms_z is not None and panel.rms_z > REMARKABLE_Z:
        yield f"residuals of {name} are {panel.rms:.2f} times the stated noise"
    if panel.ljung_box_p is not None and panel.ljung_box_p < REMARKABLE_P:
        lag1 = "" if panel.lag1 is None else f", lag 1: {panel.lag1:+.2f}"
        yield f"neighbouring residuals of {name} agree beyond chance (p = {panel.ljung_box_p:.1g}{lag1})"
