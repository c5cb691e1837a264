"""Starts that are drawn: any attitude and direction of spin, rates and instants between limits, numbers by priors.

Scenario K of a seed is drawn from these two alone, so that it is the same whatever the others are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from jaxsat.satellites import Satellite
from jaxsat.satellites.model import Leaf
from jaxsat.synthetic.twins.drawn import drawn_values

EACH = 64
"""Scenarios of one instant that follow each other."""
DAY_S = 86400.0
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)


@dataclass(frozen=True)
class Draws:
    """What scenarios are drawn from: any attitude, any direction of spin."""

    count: int = 1000
    slowest_deg_s: float = 0.1
    fastest_deg_s: float = 3.0
    """Spin rates between these are equally likely."""
    days: float = 1.0
    """After the instant of the plan, within which the instants of the starts are."""
    seed: int = 0
    instants: int = 64
    """At most; so many scenarios as 64 times that have them all."""

    def __post_init__(self):
        if not (self.count >= 1 and 0.0 <= self.slowest_deg_s < self.fastest_deg_s <= 720.0):
            raise ValueError(
                "expected at least one scenario, and rates from 0 to 720 deg/s, the slowest below the fastest"
            )
        if not 0.0 <= self.days <= 3660.0:
            raise ValueError("expected 0 to 3660 days of instants")
        if not 1 <= self.instants <= 100_000:
            raise ValueError("expected 1 to 100 000 instants")

    @property
    def instants_s(self) -> np.ndarray:
        """[instants] after the plan's: the middles of equal parts of the days, as even as they can be."""
        return np.round(DAY_S * self.days * (np.arange(self.instants) + 0.5) / self.instants) * (self.days > 0.0)

    def instant_of(self, cases: np.ndarray) -> np.ndarray:
        """Number of the instant of each scenario; the first few are spread over all days as well (golden section)."""
        order = np.argsort(np.argsort(np.arange(self.instants) * _GOLDEN % 1.0))
        return order[(np.asarray(cases) // EACH) % self.instants]


class Drawn(NamedTuple):
    """Arrays over the scenarios."""

    instant: np.ndarray
    """[cases] number of it."""
    attitude: np.ndarray
    """[cases 4] quaternion, inertial from body."""
    rate: np.ndarray
    """[cases 3] body axes [rad/s]."""
    numbers: np.ndarray
    """[cases spread] of the satellite, SI."""


def drawn(draws: Draws, satellite: Satellite, spread: Sequence[Leaf], seed: int, cases: np.ndarray) -> Drawn:
    """Scenarios by their numbers; `spread` are leaves of the satellite with the sigma that each is drawn with.

    Numbers are normal within their bounds, and together those of some body. Raises `InputError` where none are.
    """
    attitude, rate = np.empty((len(cases), 4)), np.empty((len(cases), 3))
    numbers = np.empty((len(cases), len(spread)))
    for row, case in enumerate(cases.tolist()):
        random = np.random.default_rng([seed, case])
        speed = np.radians(random.uniform(draws.slowest_deg_s, draws.fastest_deg_s))
        both = random.standard_normal(7)
        attitude[row] = both[:4] / np.linalg.norm(both[:4])
        rate[row] = speed * both[4:] / np.linalg.norm(both[4:])
        if spread:
            numbers[row] = drawn_values(satellite, spread, random)
    return Drawn(draws.instant_of(cases), attitude, rate, numbers)
