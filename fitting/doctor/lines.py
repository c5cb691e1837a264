"""The lowest chi2 along one number."""

from collections.abc import Callable, Sequence

import numpy as np

PROMISING = 0.95
"""A parabola's lowest chi2 over the lowest so far, up to which its vertex is tried."""


def lowest(chi2: Callable[[float], float], tried: Sequence[float], at_zero: float) -> tuple[float, float]:
    """Number and chi2 of the best of those `tried`, and of up to two vertices of parabolas through its neighbours."""
    found = {0.0: at_zero} | {value: chi2(value) for value in tried}
    for _ in range(2):
        values = sorted(found)
        if len(values) < 3:
            break
        k = int(np.clip(values.index(min(found, key=lambda value: found[value])), 1, len(values) - 2))
        three = values[k - 1 : k + 2]
        a, b, c = np.polyfit(three, [found[value] for value in three], 2)
        if a <= 0.0 or c - b**2 / (4.0 * a) > PROMISING * min(found.values()):
            break
        vertex = float(np.clip(-0.5 * b / a, three[0], three[2]))
        found[vertex] = chi2(vertex)
    best = min(found, key=lambda value: found[value])
    return best, found[best]
