"""How a fit used each panel current: for pictures of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True)
class CurrentMarks:
    """Which currents [time 6] a fit left out, used, and used with a reduced weight."""

    left_out: Bool[np.ndarray, "time 6"]
    used: Bool[np.ndarray, "time 6"]
    reduced: Bool[np.ndarray, "time 6"]
    """Used with less than half of the median weight."""


def current_marks(
    measured: Float[np.ndarray, "time 6"],
    weight: Float[np.ndarray, "time 6"],
    lit: Bool[np.ndarray, "time"],
    limited: Bool[np.ndarray, "time"],
) -> CurrentMarks:
    """Returns the marks from currents, final weights, sunlight and the samples that were left out whole."""
    # A panel that sees nothing has no weight either, and it is no outlier: only a current can be left out.
    left_out = (measured > 0) & (((weight <= 0) & lit[:, None]) | limited[:, None])
    used = (weight > 0) & ~left_out
    reduced = used & (weight < 0.5 * np.median(weight[used])) if used.any() else used
    return CurrentMarks(left_out, used, reduced)
