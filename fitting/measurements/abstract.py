"""What a solver asks of the data of a fit."""

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PyTree

from fitting.measurements.groups import Groups
from fitting.stored import part_of
from jaxsat.integrators import BLOCK, StepGrid
from jaxsat.math import quaternion

Visit = Callable[[Any, tuple[Array, Array], Array], Any]
"""visit(carry, (residual, jacobian), begin) -> carry, of a block of samples of which the first is number `begin`."""

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
    rotation_jacobian: Float[Array, "samples 3 unknowns"] | None
    """Small rotation in body axes [rad] for a unit change of each unknown; None where a solver is on its way."""


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
        visit: Visit,
        carry: Any,
        exact: bool = False,
    ) -> tuple[Prediction, Any]:
        """Residuals of one start about the attitude `reference` at the grid's start; what `visit` makes of the rest.

        `carry` goes through `visit(carry, (residual, jacobian), begin)` for each block of `PAD_SAMPLES` samples of the
        arc, the first of them number `begin`; the Jacobian [block channels unknowns] is never there as a whole.
        `blocks` of steps are taken. With `exact` derivatives they are those of the steps themselves, else those of the
        motion, off by what a step is off, in a quarter of the time.
        """

    def predict(
        self,
        parameters: Any,
        x: Float[Array, " unknowns"],
        reference: Float[Array, "4"],
        blocks: Int[Array | np.ndarray, ""],
    ) -> tuple[Prediction, Float[Array, "samples channels unknowns"]]:
        """Residuals of one start as in `predict_blocks`, and their whole Jacobian, exact."""

        def store(jacobian, new, begin):
            return jax.lax.dynamic_update_slice_in_dim(jacobian, new[1], begin, axis=0)

        blank = jnp.zeros((self.valid.shape[0], self.channels, x.shape[0]), dtype=x.dtype)
        return self.predict_blocks(parameters, x, reference, blocks, visit=store, carry=blank, exact=True)

    def over_arc(
        self,
        whitened: Callable[..., tuple[Array, Array]],
        inputs: PyTree,
        blocks: Int[Array | np.ndarray, ""],
        visit: Visit,
        carry: Any,
    ) -> tuple[Float[Array, "samples channels"], Any]:
        """Residuals of the arc's samples, block by block, and the `carry` that went through `visit`.

        `whitened(*part)` gives residuals and Jacobian of a block, `part` being those of `inputs` that belong to it.
        Samples after the arc are left alone: on the first, short arcs the sensors would cost more than the motion.
        """

        def sample_block(number, carry):
            residual, carry = carry
            begin = number * PAD_SAMPLES
            part = jax.tree.map(
                lambda leaf: jax.lax.dynamic_slice_in_dim(jnp.asarray(leaf), begin, PAD_SAMPLES), inputs
            )
            new = whitened(*part)
            residual = jax.lax.dynamic_update_slice_in_dim(residual, new[0], begin, axis=0)
            return residual, visit(carry, new, begin)

        def every_block(count, carry):
            return jax.lax.fori_loop(0, count, sample_block, (jnp.zeros((self.valid.shape[0], self.channels)), carry))

        samples = jnp.sum(jnp.asarray(self.grid.sample_index) <= blocks * BLOCK)
        return part_of(every_block)((samples + PAD_SAMPLES - 1) // PAD_SAMPLES, carry)


def small_turns(
    q: Float[Array, "samples 4"], tangents: Float[Array, "samples 4 unknowns"]
) -> Float[Array, "samples 3 unknowns"]:
    """The rotation r in body axes that each unit tangent q' = q (0, r/2) of attitudes stands for."""
    product = jax.vmap(lambda p: quaternion.multiply(quaternion.conjugate(q), p), in_axes=-1, out_axes=-1)
    return 2.0 * product(tangents)[:, 1:]
