"""Control laws as a loop runs them: what they remember, and the commands of a control period.

A controller is an object with `start()` and `update(memory, estimate, now)`, which returns the memory and `Commands`.
"""

from abc import abstractmethod
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.control.laws import damping_dipole
from jaxsat.control.loops.estimators import Estimate, Now
from jaxsat.math import cross, float_array
from jaxsat.torques.abstract import required


class Commands(eqx.Module):
    """What is wanted of the actuators for a control period, body axes."""

    dipole: Float[Array, "3"]
    """[A m^2]"""
    torque: Float[Array, "3"]
    """Of the wheels on the body [N m]."""
    thrust: Float[Array, "3"] | None = None
    """Mean torque of the thrusters [N m]; None for none."""
    dead_band: Float[Array, " thrusters"] | None = None
    """Torque of each couple of them below which it stays silent [N m]; None for none."""


class AbstractController(eqx.Module):
    """From an estimate to commands."""

    @abstractmethod
    def start(self) -> Any:
        """What it remembers before the first period."""

    @abstractmethod
    def update(self, memory: Any, estimate: Estimate, now: Now) -> tuple[Any, Commands]:
        """The memory after a control period's decision, and its commands."""


class Idle(AbstractController):
    """Commands nothing."""

    def start(self) -> None:
        return None

    def update(self, memory: None, estimate: Estimate, now: Now) -> tuple[None, Commands]:
        return None, Commands(jnp.zeros(3), jnp.zeros(3))


class LastField(eqx.Module):
    """The last reading of the field."""

    b_field_body: Float[Array, "3"]
    """[T]"""
    age: Float[Array, ""]
    """[s]"""
    known: Bool[Array, ""]


class FieldDifference(AbstractController):
    """B-dot by the difference of successive readings of the magnetometer (Stickler & Alfriend 1976).

    Nothing is commanded before the second reading, nor in a period without one.
    """

    gain: Float[Array, ""] = eqx.field(converter=float_array)
    """[N m s]"""

    def start(self) -> LastField:
        return LastField(jnp.zeros(3), jnp.zeros(()), jnp.asarray(False))

    def update(self, memory: LastField, estimate: Estimate, now: Now) -> tuple[LastField, Commands]:
        field = _needed(estimate.b_field_body, "FieldDifference", "a magnetometer")
        fresh = _needed(estimate.field_fresh, "FieldDifference", "a magnetometer")
        age = memory.age + now.period
        dipole = damping_dipole(self.gain, field, (field - memory.b_field_body) / age)
        dipole = jnp.where(fresh & memory.known, dipole, 0.0)
        kept = LastField(jnp.where(fresh, field, memory.b_field_body), jnp.where(fresh, 0.0, age), memory.known | fresh)
        return kept, Commands(dipole, jnp.zeros(3))


class RateAcrossField(AbstractController):
    """B-dot by a gyro: the field changes by B x w in the body's axes (Avanzini & Giulietti 2012)."""

    gain: Float[Array, ""] = eqx.field(converter=float_array)
    """[N m s]"""

    def start(self) -> None:
        return None

    def update(self, memory: None, estimate: Estimate, now: Now) -> tuple[None, Commands]:
        field = _needed(estimate.b_field_body, "RateAcrossField", "a magnetometer")
        rate = _needed(estimate.angular_velocity, "RateAcrossField", "a gyro")
        return None, Commands(damping_dipole(self.gain, field, cross(field, rate)), jnp.zeros(3))


def _needed(entry, user: str, sensor: str):
    return required(entry, user, "what the estimator does not tell", sensor)
