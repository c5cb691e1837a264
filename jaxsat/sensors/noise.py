"""From a sensor's mean reading to what telemetry says: noise, then steps of the number that is sent."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import unit

Size = float | Float[Array, ""]


def normal_noise(reading: Float[Array, " channels"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " channels"]:
    """The reading with normal noise of `sigma` on each channel."""
    return reading + sigma * jax.random.normal(key, reading.shape, reading.dtype)


def unit_noise(reading: Float[Array, " channels"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " channels"]:
    """The same of a unit vector, a unit again; of two columns alone nobody knows the length."""
    noisy = normal_noise(reading, sigma, key)
    return unit(noisy) if reading.shape[0] > 2 else noisy


def stepped(reading: Float[Array, "*shape"], quantum: Size) -> Float[Array, "*shape"]:
    """The reading in whole steps of `quantum`, in its unit; as it is where that is zero."""
    step = jnp.asarray(quantum, reading.dtype)
    some = step > 0.0
    return jnp.where(some, jnp.round(reading / jnp.where(some, step, 1.0)) * step, reading)
