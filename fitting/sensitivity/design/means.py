"""Slopes of the mean of a metric that has none of its own: what a chaotic motion does, averaged over many starts.

From a tumble the derivative of a single motion is exact and of no use: it grows without bound, and the mean of it over
starts is not the derivative of the mean. That is taken here of the mean over starts *and* over a small normal spread of
the design (Gaussian smoothing: Nesterov & Spokoiny 2017, eq. 21), which any metric has:

    d/dx E f(x + s u) = E (f(x + s u) - f(x - s u)) u / (2 s),   u normal.

Each start is run twice, with u and with -u (Hammersley & Morton 1956), and the slopes are the least squares of the half
differences on s u, with errors that need no noise of one size (HC3: MacKinnon & White 1985).

All numbers move at once, for what a chaotic motion does is noise to each slope whatever moves it. Where cases are not
chaotic but stairs, each number is better moved alone: `jaxsat.control.sun_pointing.sensitivities`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Metric = Callable[[np.ndarray], np.ndarray]
"""Values [2 starts] for designs [2 starts, numbers]: rows k and starts + k begin alike. NaN where there is none."""


@dataclass(frozen=True)
class MeanSlopes:
    """Mean of a metric over starts, and its derivatives by the numbers of a design."""

    mean: float
    mean_sigma: float
    slopes: np.ndarray
    """[numbers]."""
    sigma: np.ndarray
    """[numbers] sampling error, 1-sigma."""
    left_out: int
    """Starts that have no finite value."""


def slopes_of_mean(
    metric: Metric, at: np.ndarray | Sequence[float], width: float | np.ndarray, starts: int, seed: int = 0
) -> MeanSlopes:
    """Derivatives of the mean of `metric` at a design `at` [numbers], smoothed by `width` in each number.

    The spread of the designs depends on `seed` and `starts` alone, so that two calls have it in common. Raises
    ValueError for widths that are not positive, and where fewer than two more starts than numbers have a value.
    """
    at = np.asarray(at, float)
    width = np.broadcast_to(np.asarray(width, float), at.shape)
    if not (np.isfinite(width).all() and (width > 0.0).all()):
        raise ValueError(f"slopes_of_mean: expected positive widths, got {width}")
    push = width * np.random.default_rng(seed).standard_normal((starts, len(at)))
    found = np.asarray(metric(np.concatenate([at + push, at - push])), float)
    if found.shape != (2 * starts,):
        raise ValueError(f"slopes_of_mean: the metric has shape {found.shape}, expected {(2 * starts,)}")
    high, low = found[:starts], found[starts:]
    known = np.isfinite(high) & np.isfinite(low)
    if known.sum() < len(at) + 2:
        raise ValueError(f"slopes_of_mean: only {known.sum()} of {starts} starts have a value")
    push, half, middle = push[known], 0.5 * (high - low)[known], 0.5 * (high + low)[known]
    slopes = np.linalg.lstsq(push, half, rcond=None)[0]
    # What is left over is no noise of one size: it goes with the push where the metric bends or jumps.
    reach = np.linalg.pinv(push)
    left = (half - push @ slopes) / (1.0 - np.einsum("kn,nk->k", push, reach))
    sigma = np.linalg.norm(reach * left, axis=1)
    mean_sigma = float(middle.std(ddof=1) / np.sqrt(len(middle)))
    return MeanSlopes(float(middle.mean()), mean_sigma, slopes, sigma, starts - len(middle))


def descended(
    slopes_at: Callable[[np.ndarray, int], MeanSlopes],
    start: np.ndarray,
    *,
    low: np.ndarray,
    high: np.ndarray,
    step: float,
    steps: int,
) -> tuple[np.ndarray, list[tuple[np.ndarray, MeanSlopes]]]:
    """A design by steps against slopes that have errors, within bounds; and the designs on the way with theirs.

    `slopes_at(design, number)` gives them at step `number`. Steps have the length `step / sqrt(1 + number)`, for the
    size of slopes says little of how far to go; a number whose slope is within its error moves by less. The result is
    the mean of the last third of the designs (Polyak & Juditsky 1992). Raises ValueError for bounds or steps that
    are none.
    """
    low, high = np.asarray(low, float), np.asarray(high, float)
    if not ((low < high).all() and step > 0.0 and steps >= 3):
        raise ValueError("descended: expected low < high, a positive step and at least three steps")
    design, way = np.clip(np.asarray(start, float), low, high), []
    for number in range(steps):
        found = slopes_at(design, number)
        way.append((design, found))
        free = ~(((design <= low) & (found.slopes > 0.0)) | ((design >= high) & (found.slopes < 0.0)))
        # Shrunk by its error, as a normal prior as wide as the slope itself would have it.
        believed = free * found.slopes**3 / (found.slopes**2 + found.sigma**2 + np.finfo(float).tiny)
        size = np.linalg.norm(believed)
        if size == 0.0:
            break
        design = np.clip(design - step / np.sqrt(1.0 + number) * believed / size, low, high)
    last = np.array([each for each, _ in way] + [design])[-max(len(way) // 3, 1) :]
    return last.mean(axis=0), way
