"""What a solver asks of the data of a fit."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.measurements.groups import Groups
from jaxsat.integrators import StepGrid

PAD_SAMPLES = 16
PAD_STEPS = 64
"""Samples and steps of a problem are padded to multiples of these."""

RATE_UNIT = 1.0 / 60.0
"""Unit of the rate unknowns [rad/s]: a radian, the attitude's own unit, in a minute."""


class Prediction(eqx.Module):
    """Whitened residuals of one trajectory and the attitude behind them."""

    residual: Float[Array, "samples channels"]
    """(modelled - measured) / sigma."""
    quaternion: Float[Array, "samples 4"]
    angular_velocity: Float[Array, "samples 3"]
    rotation_jacobian: Float[Array, "samples 3 unknowns"]
    """Small rotation in body axes [rad] for a unit change of each unknown."""


class AbstractProblem(eqx.Module):
    """Everything about a session that does not change while it is fitted."""

    grid: eqx.AbstractVar[StepGrid]
    valid: eqx.AbstractVar[Bool[Array | np.ndarray, " samples"]]
    """False for padding."""
    floor: eqx.AbstractVar[Float[Array | np.ndarray, "samples channels"]]
    """What a reading of zero may have been at most, in sigmas; -inf where a reading is above the telemetry's floor."""

    @property
    @abstractmethod
    def groups(self) -> Groups:
        """Columns of residuals that belong together, static."""

    @property
    def channels(self) -> int:
        """Columns of residuals."""
        return sum(group.width for group in self.groups)

    @abstractmethod
    def telling(self) -> Bool[np.ndarray, "samples groups"]:
        """Whether a sample's readings would show a wrong attitude, on the host: not those of panels in the dark."""

    @abstractmethod
    def predict_blocks(
        self,
        parameters: Any,
        x: Float[Array, " unknowns"],
        reference: Float[Array, "4"],
        blocks: Int[Array | np.ndarray, ""],
        *,
        visit: Callable[[Any, tuple[Array, Array], Array], Any],
        carry: Any,
    ) -> tuple[Prediction, Any]:
        """Residuals of one start about the attitude `reference` at the grid's start; what `visit` makes of the rest.

        `carry` goes through `visit(carry, (residual, jacobian), begin)` for each block of `PAD_SAMPLES` samples of the
        arc, the first of them number `begin`; the Jacobian [block channels unknowns] is exact and never there as a
        whole. `blocks` of steps are taken.
        """
