"""Which measurements of a sample stand or fall together: one sensor's readings at one instant."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import chdtrc, chdtri

SIX_CURRENTS_LIMIT = 30.0
"""Sum of squared residuals over the six panels of a sample, in sigmas, beyond which its currents are left out.

Noise alone exceeds it once in 25 000 samples (chi-square, 6 degrees of freedom); a charge current limited to 80 %
exceeds it by far, for the brightest panel of a box never carries less than 58 % of its maximum current.
"""
BY_CHANCE = float(chdtrc(6, SIX_CURRENTS_LIMIT))
"""Probability that noise exceeds the limit of a sample, whatever their number."""


@dataclass(frozen=True)
class Group:
    """Neighbouring columns of residuals that belong to one sensor; static in compiled programs."""

    name: str
    width: int
    """Columns."""
    loss: str | None = None
    """`normal` or `student` where no sample of it may be an outlier, whatever the fit allows others."""

    @cached_property
    def limit(self) -> float:
        """Sum of squares of a sample beyond which it is an outlier [sigma^2]; inf where there are none."""
        if self.loss in ("normal", "student"):
            return math.inf
        return float(chdtri(self.width, BY_CHANCE))


Groups = tuple[Group, ...]


def columns_of(groups: Groups) -> list[slice]:
    """Where each group stands among the columns of residuals."""
    ends = np.cumsum([group.width for group in groups])
    return [slice(int(end) - group.width, int(end)) for group, end in zip(groups, ends, strict=True)]


def of_groups(squares: np.ndarray, groups: Groups) -> np.ndarray:
    """[... groups] sums over the columns of each group; `squares` [... columns], on the host."""
    return np.stack([squares[..., columns].sum(axis=-1) for columns in columns_of(groups)], axis=-1)


def over_columns(flags: np.ndarray, groups: Groups) -> np.ndarray:
    """[... columns] what is said of the groups [... groups], for each of their columns."""
    return np.repeat(flags, [group.width for group in groups], axis=-1)
