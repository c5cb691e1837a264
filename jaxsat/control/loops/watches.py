"""What is noted of a case on its way, for its metrics."""

from abc import abstractmethod
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.control.loops.samples import Sample
from jaxsat.control.loops.timeline import Instant
from jaxsat.math import float_array


class AbstractWatch(eqx.Module):
    """Notes something at each control period."""

    @abstractmethod
    def start(self) -> Any:
        """Before the first control period."""

    @abstractmethod
    def update(self, tally: Any, sample: Sample, here: Instant) -> Any:
        """After the decision at the beginning of a control period."""


class RateTally(eqx.Module):
    """What `RateWatch` notes."""

    above_until: Float[Array, ""]
    """End of the last period that began with a rate at the limit or above [s]; 0 for none."""
    largest: Float[Array, ""]
    """Square of the largest rate [rad^2/s^2]."""
    impulse: Float[Array, ""]
    """Sum of the torquers' dipoles over the time they are on [A m^2 s]."""
    saturated: Float[Array, ""]
    """Periods in which a torquer is at its largest dipole."""


class RateWatch(AbstractWatch):
    """When the rate was last above a limit, and what damping it took."""

    limit: Float[Array, ""] = eqx.field(converter=float_array)
    """[rad/s]"""
    period: float = eqx.field(static=True)
    """[s]"""
    duty: float = eqx.field(static=True)

    def start(self) -> RateTally:
        zero = jnp.zeros(())
        return RateTally(zero, zero, zero, zero)

    def update(self, tally: RateTally, sample: Sample, here: Instant) -> RateTally:
        square = jnp.sum(sample.motion.angular_velocity**2)
        size = sample.dipole_sizes
        full = jnp.zeros((), bool) if sample.max_dipoles is None else jnp.any(size >= sample.max_dipoles)
        return RateTally(
            above_until=jnp.where(square >= self.limit**2, here.time + self.period, tally.above_until),
            largest=jnp.maximum(tally.largest, square),
            impulse=tally.impulse + self.duty * self.period * jnp.sum(size),
            saturated=tally.saturated + jnp.where(full, 1.0, 0.0),
        )
