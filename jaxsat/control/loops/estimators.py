"""What a control law is told: the truth, or the readings as they are. A filter stands in the same place.

An estimator is an object with `start()`, what it remembers before the first period, and with
`update(memory, readings, now)`, which returns the memory and an `Estimate`; both are written for one satellite, in JAX.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.control.loops.timeline import Instant
from jaxsat.control.loops.vehicle import Motion
from jaxsat.math import quaternion


class Now(eqx.Module):
    """What is known at the beginning of a control period."""

    here: Instant
    """The surroundings, by the models on board."""
    period: Float[Array, ""]
    """[s]"""
    truth: Motion
    """For estimators that make no errors; wheels tell their speed to every law."""


class Estimate(eqx.Module):
    """What a law is told, body axes; None where no sensor tells it."""

    b_field_body: Float[Array, "3"] | None = None
    """[T]"""
    field_fresh: Bool[Array, ""] | None = None
    """Whether the field was read in this period."""
    angular_velocity: Float[Array, "3"] | None = None
    """[rad/s]"""
    quaternion: Float[Array, "4"] | None = None
    """inertial-from-body."""
    attitude_known: Bool[Array, ""] | None = None
    """Whether the attitude is known yet; None where it always is."""
    sun: Float[Array, "3"] | None = None
    """Direction to the Sun, in the axes of its sensor as they are known."""
    sun_known: Bool[Array, ""] | None = None


class AbstractEstimator(eqx.Module):
    """From readings to an estimate."""

    calls_libraries: ClassVar[bool] = False
    """Whether it takes eigenvalues or the like from a library: a loop of it is no single function of machine code."""

    @abstractmethod
    def start(self) -> Any:
        """What it remembers before the first reading."""

    @abstractmethod
    def update(self, memory: Any, readings: Mapping[str, Any], now: Now) -> tuple[Any, Estimate]:
        """The memory after a control period's readings, and the estimate."""


class Perfect(AbstractEstimator):
    """The truth, whatever the sensors say."""

    def start(self) -> None:
        return None

    def update(self, memory: None, readings: Mapping[str, Any], now: Now) -> tuple[None, Estimate]:
        q = now.truth.quaternion
        field = quaternion.rotate_inverse(q, now.here.b_field_eci)
        return None, Estimate(field, jnp.asarray(True), now.truth.angular_velocity, q)


class AsRead(AbstractEstimator):
    """The last readings as they are."""

    def start(self) -> None:
        return None

    def update(self, memory: None, readings: Mapping[str, Any], now: Now) -> tuple[None, Estimate]:
        field, rate, attitude = (readings.get(name) for name in ("field", "rate", "attitude"))
        return None, Estimate(
            b_field_body=None if field is None else field.value,
            field_fresh=None if field is None else field.fresh,
            angular_velocity=None if rate is None else rate.value,
            quaternion=None if attitude is None else attitude.value,
        )
