"""The attitude filter as an estimator of a loop: gyro, Sun and field to attitude, rate and bias."""

from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.control.loops.estimators import AbstractEstimator, Estimate, Now
from jaxsat.estimation.attitude_filter import AttitudeBelief, AttitudeFilter
from jaxsat.estimation.attitude_readings import AttitudeReadings
from jaxsat.math import float_array
from jaxsat.torques.abstract import required

NEEDED = "field, rate and sun among the channels"


class FilterMemory(eqx.Module):
    """What `Filtered` believes."""

    belief: AttitudeBelief
    known: Bool[Array, ""]
    """Whether Sun and field have been seen at once yet: from then on the filter runs."""


class Filtered(AbstractEstimator):
    """`AttitudeFilter` on the last readings; it begins when Sun and field are first seen at once."""

    # The first attitude is an eigenvector.
    calls_libraries: ClassVar[bool] = True

    filter: AttitudeFilter
    field_sigma: Float[Array, ""] = eqx.field(converter=float_array)
    """1-sigma of the field's direction about each axis across it, calibration included [rad]."""
    sun_sigma: Float[Array, ""] = eqx.field(converter=float_array)
    """Of the Sun's [rad]."""
    bias_sigma: Float[Array, ""] = eqx.field(converter=float_array)
    """1-sigma of the gyro's bias about each axis at the beginning [rad/s]."""

    def start(self) -> FilterMemory:
        belief = AttitudeBelief(jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.zeros(3), jnp.eye(6))
        return FilterMemory(belief, jnp.asarray(False))

    def update(self, memory: FilterMemory, readings: Mapping[str, Any], now: Now) -> tuple[FilterMemory, Estimate]:
        field, rate, sun = (
            required(readings.get(name), "Filtered", f"the reading {name!r}", NEEDED)
            for name in ("field", "rate", "sun")
        )
        given = AttitudeReadings(
            rate=rate.value,
            body=jnp.stack([field.value, sun.value]),
            eci=jnp.stack([now.here.b_field_eci, now.here.sun_eci]),
            sigma=jnp.stack([self.field_sigma, self.sun_sigma]),
            known=jnp.stack([field.fresh, sun.fresh]),
        )

        def step(carried, _):
            memory, estimator, given, period = carried
            both = jnp.all(given.known)
            first = estimator.filter.start_from(given, bias_sigma_rad_s=estimator.bias_sigma)
            later, _ = estimator.filter.update(memory.belief, given, period)

            def chosen(old, first, later):
                return jnp.where(memory.known, later, jnp.where(both, first, old))

            belief = jax.tree.map(chosen, memory.belief, first, later)
            return (FilterMemory(belief, memory.known | both), estimator, given, period), None

        # As one piece: element by element its matrices of six by six would take long to compile.
        (after, *_), _ = jax.lax.scan(step, (memory, self, given, now.period), None, length=1)
        return after, Estimate(
            b_field_body=field.value,
            field_fresh=field.fresh,
            angular_velocity=rate.value - after.belief.bias,
            quaternion=after.belief.quaternion,
            attitude_known=after.known,
        )
