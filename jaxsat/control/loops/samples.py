"""A control period of a loop as a person would plot it."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.control.actuators import Pulses
from jaxsat.control.loops.estimators import Estimate
from jaxsat.control.loops.vehicle import Motion


class Sample(eqx.Module):
    """One control period: its beginning, and what was commanded then."""

    motion: Motion
    readings: dict[str, Any]
    estimate: Estimate
    dipoles: Float[Array, " torquers"] | None
    """[A m^2]"""
    motors: Float[Array, " wheels"] | None
    """[N m]"""
    pulses: Pulses | None
    decision: Any
    """What the controller remembers of it."""
    max_dipoles: Float[Array, " torquers"] | None = None
    """Of each torquer [A m^2]."""

    @property
    def dipole_sizes(self) -> Float[Array, " torquers"]:
        """[A m^2]; a single zero without torquers."""
        return jnp.zeros(1) if self.dipoles is None else jnp.abs(self.dipoles)
