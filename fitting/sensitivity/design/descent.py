"""A design by steps along slopes that have errors, as those of the mean of a chaotic motion."""

from collections.abc import Callable

import numpy as np

from fitting.sensitivity.means.pairs import MeanSlopes


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
