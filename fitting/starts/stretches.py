"""Where in a session the search begins: at its longest sunlit stretch, from which the motion is carried to the first.

Arcs that grow across the Earth's shadow leap over half an hour at once, and no start survives that while it is known
over a few minutes alone. Where the session begins with the shorter side of a shadow, the search begins behind it.

And which samples it takes: arcs cost as much as there are samples, and as many steps, for a step ends at each. Of a
session read every second a few hundred tell the motion as well as thousands; the last rounds take all of them.
"""

import numpy as np

from fitting.measurements.assembly import Samples

LONG_GAP_SAMPLES, LONG_GAP_S = 6.0, 300.0
"""A gap between lit samples parts two stretches where it is longer than so many usual ones and so many seconds."""
MANY = 2000
"""Samples up to which all of them are searched."""
FARTHEST = 0.5
"""Angle at the highest rate between two samples that are left [rad]: half of what carries a sight between two."""


def longest_stretch(t: np.ndarray, lit: np.ndarray) -> int:
    """Index of the first sample of the stretch with the most lit samples, the earliest of several.

    `t` [time] and `lit` [time] are those of all samples, two of them lit at least.
    """
    place = np.flatnonzero(lit)
    gaps = np.diff(t[place])
    parted = gaps > max(LONG_GAP_SAMPLES * float(np.median(gaps)), LONG_GAP_S)
    stretches = np.split(place, np.flatnonzero(parted) + 1)
    return int(max(stretches, key=len)[0])


def searched_samples(samples: Samples, begin: int, fastest: float) -> np.ndarray:
    """Numbers of the samples from `begin` on that are searched, of motions of up to so many rad/s.

    Of each channel one reading in each stretch of time in which the body turns by `FARTHEST` at most.
    """
    numbers = np.arange(begin, len(samples.t))
    if len(samples.t) <= MANY:
        return numbers
    stretch = np.floor((samples.t - samples.t[begin]) * fastest / FARTHEST).astype(int)
    kept = np.zeros(len(samples.t), bool)
    kept[begin] = True
    for rows in samples.values.values():
        measured = numbers[np.isfinite(rows[begin:]).any(axis=1)]
        kept[measured[np.unique(stretch[measured], return_index=True)[1]]] = True
    return np.flatnonzero(kept)
