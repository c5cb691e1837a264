"""What a sensor sees over time: directions in the body, or attitudes, read also between its stamps."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from jaxsat.math.on_host import angles_between

_SAME_S = 0.01
_NEAR_STEPS, _NEAR_RAD = 3.0, math.radians(30.0)
"""Between two readings, no further apart than this in usual spacings and in angle, a direction is known too."""


@dataclass(frozen=True)
class Sight:
    """Directions that a sensor sees, or attitudes."""

    name: str
    of: str
    """`field`, `sun`, `nadir` or `attitude`."""
    t: Float[np.ndarray, "n"]
    seen: Float[np.ndarray, "n of"]
    """Unit vectors in body axes, or quaternions."""
    sigma: Float[np.ndarray, "n"]
    """[rad]"""

    def at(self, t: Float[np.ndarray, "m"]) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m"]]:
        """The directions at other times and their sigma, NaN where no readings are near."""
        right = np.clip(np.searchsorted(self.t, t), 1, max(self.t.size - 1, 1))
        if self.t.size < 2:
            right = np.zeros(t.size, int)
        left = np.maximum(right - 1, 0)
        nearest = np.where(np.abs(self.t[left] - t) < np.abs(self.t[right] - t), left, right)
        span = self.t[right] - self.t[left]
        share = np.where(span > 0.0, (t - self.t[left]) / np.where(span > 0.0, span, 1.0), 0.0)
        between = (share > 0.0) & (share < 1.0)
        between &= span <= _NEAR_STEPS * (np.median(np.diff(self.t)) if self.t.size > 1 else 0.0)
        between &= angles_between(self.seen[left], self.seen[right]) < _NEAR_RAD
        carried = (1.0 - share)[:, None] * self.seen[left] + share[:, None] * self.seen[right]
        same = np.abs(self.t[nearest] - t) <= _SAME_S
        found = np.where(same[:, None], self.seen[nearest], np.where(between[:, None], carried, np.nan))
        return found / np.linalg.norm(found, axis=1, keepdims=True), self.sigma[nearest]

    def part(self, which: Bool[np.ndarray, "n"]) -> "Sight":
        """Some of them."""
        return replace(self, t=self.t[which], seen=self.seen[which], sigma=self.sigma[which])
