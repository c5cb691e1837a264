"""Starts that are drawn: any attitude and direction of spin, rates and instants between limits."""

from dataclasses import dataclass

import numpy as np

from jaxsat.time import Epoch

MOST_INSTANTS = 64
LEAST_EACH = 64
"""Scenarios of one instant, below which there are fewer instants."""
DAY_S = 86400.0


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

    def __post_init__(self):
        if not (self.count >= 1 and 0.0 <= self.slowest_deg_s < self.fastest_deg_s <= 720.0):
            raise ValueError(
                "expected at least one scenario, and rates from 0 to 720 deg/s, the slowest below the fastest"
            )
        if not 0.0 <= self.days <= 3660.0:
            raise ValueError("expected 0 to 3660 days of instants")


def drawn_starts(first: Epoch, draws: Draws) -> tuple[Epoch, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The plan's instant, instants [s] after it, which each case has, attitudes and rates [rad/s], by their numbers."""
    count = int(np.clip(draws.count // LEAST_EACH, 1, MOST_INSTANTS))
    # The middle of so many equal parts: as even as they can be.
    instants = DAY_S * draws.days * ((np.arange(count) + 0.5) / count if draws.days > 0.0 else np.zeros(count))
    uniform, normal = (np.random.default_rng([draws.seed, stream]) for stream in (0, 1))
    speed = uniform.uniform(draws.slowest_deg_s, draws.fastest_deg_s, size=draws.count)
    both = normal.standard_normal((draws.count, 7))
    attitude = both[:, :4] / np.linalg.norm(both[:, :4], axis=1, keepdims=True)
    axis = both[:, 4:] / np.linalg.norm(both[:, 4:], axis=1, keepdims=True)
    return first, np.round(instants), np.arange(draws.count) % count, attitude, np.radians(speed)[:, None] * axis
