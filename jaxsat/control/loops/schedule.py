"""When a loop does what: its control periods, when coils are on in them, and the steps of the motion."""

import math
from dataclasses import dataclass

import numpy as np

from jaxsat.integrators import step_for
from jaxsat.math.runge_kutta import RK4

TUMBLING = 0.08
"""Error of a steady turn over that of a body of moments 5 : 5 : 1 that tumbles at the same rate; measured, 0.1."""


@dataclass(frozen=True)
class Schedule:
    """Control periods, all alike. At the beginning of each the sensors are read and the actuators are commanded.

    Magnetorquers are on for the share `duty` of a period; then they are off until the magnetometer is read again.
    """

    period_s: float
    step_s: float
    """Longest step of the motion's integration."""
    duty: float = 1.0
    modes: tuple[tuple[float, int], ...] = ()
    """Times [s], rising, from which on the controller is in a mode, by number; mode 0 before the first."""

    def __post_init__(self):
        if not (self.period_s > 0.0 and self.step_s > 0.0):
            raise ValueError(f"Schedule: period_s and step_s must be above zero, got {self.period_s} and {self.step_s}")
        if not 0.0 < self.duty <= 1.0:
            raise ValueError(f"Schedule: duty must be above 0 and at most 1, got {self.duty}")
        if any(late <= early for (early, _), (late, _) in zip(self.modes, self.modes[1:], strict=False)):
            raise ValueError("Schedule: the times of modes must rise")

    @property
    def edges(self) -> np.ndarray:
        """Ends of the steps within a period [s], from 0 to the period; the coils are switched off at one of them."""
        on = self.duty * self.period_s
        parts = [np.linspace(0.0, on, self._steps(on) + 1)]
        if self.duty < 1.0:
            parts.append(np.linspace(on, self.period_s, self._steps(self.period_s - on) + 1)[1:])
        return np.concatenate(parts)

    def _steps(self, span: float) -> int:
        return max(1, math.ceil(span / self.step_s * (1.0 - 1e-9)))

    @property
    def on(self) -> np.ndarray:
        """Whether the coils are on in each step of a period [steps]."""
        return self.edges[:-1] < self.duty * self.period_s * (1.0 - 1e-9)

    def mode_at(self, times: np.ndarray) -> np.ndarray:
        """Number of the mode at times [s]."""
        starts = np.array([start for start, _ in self.modes])
        numbers = np.array([0, *(number for _, number in self.modes)])
        return numbers[np.searchsorted(starts, np.asarray(times) * (1.0 + 1e-12), side="right")]

    def periods(self, duration_s: float) -> int:
        """Control periods that a time takes, the last one whole."""
        return math.ceil(duration_s / self.period_s * (1.0 - 1e-9))


def step_within(tolerance: float, rate: float, duration_s: float, *, rods: bool = False) -> float:
    """Step [s] with which RK4 follows a tumbling body at `rate` [rad/s] for a time [s] within a tolerance [rad].

    That of a steady turn for a twelfth of the tolerance: beside the attitude the axis errs on its way through the body.
    With rods that have hysteresis half of it, for the turns of the field along them; measured.
    """
    return step_for(RK4, rate, duration_s, TUMBLING * tolerance) * (0.5 if rods else 1.0)
