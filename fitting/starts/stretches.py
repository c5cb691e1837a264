"""Where in a session the search begins: at its longest sunlit stretch, from which the motion is carried to the first.

Arcs that grow across the Earth's shadow leap over half an hour at once, and no start survives that while it is known
over a few minutes alone. Where the session begins with the shorter side of a shadow, the search begins behind it.
"""

import numpy as np

LONG_GAP_SAMPLES, LONG_GAP_S = 6.0, 300.0
"""A gap between lit samples parts two stretches where it is longer than so many usual ones and so many seconds."""


def longest_stretch(t: np.ndarray, lit: np.ndarray) -> int:
    """Index of the first sample of the stretch with the most lit samples, the earliest of several.

    `t` [time] and `lit` [time] are those of all samples, two of them lit at least.
    """
    place = np.flatnonzero(lit)
    gaps = np.diff(t[place])
    parted = gaps > max(LONG_GAP_SAMPLES * float(np.median(gaps)), LONG_GAP_S)
    stretches = np.split(place, np.flatnonzero(parted) + 1)
    return int(max(stretches, key=len)[0])
