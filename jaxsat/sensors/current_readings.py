"""From the currents of panels to what telemetry says of them: limited charge current, noise, zero offset, steps.

The disturbances of the program `Orfs` (Penkov et al. 2009, sections 3.8 and 4). Mean and noise are separate functions.
"""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.sensors.sun_sensor import quantize

Draw = Callable[[PRNGKeyArray, tuple[int, ...]], Float[Array, "..."]]
"""Gives numbers of mean zero and variance one, as `jax.random.normal` does."""


def uniform_noise(key: PRNGKeyArray, shape: tuple[int, ...]) -> Float[Array, "..."]:
    """Numbers of mean zero and variance one, uniform between -sqrt 3 and sqrt 3."""
    return jax.random.uniform(key, shape, minval=-math.sqrt(3.0), maxval=math.sqrt(3.0))


def limited_currents(
    currents: Float[Array, "*batch 6"],
    factors: Float[Array, "3"],
    *,
    panel_limit: float | Float[Array, ""] = math.inf,
    sum_limit: float | Float[Array, ""] = math.inf,
) -> Float[Array, "*batch 6"]:
    """Currents of six panels while the charge of the battery is limited [A].

    In turn: the factors l_x, l_y, l_z of the panels on an axis (Penkov et al. 2009, section 4, figure 29), the largest
    current of a panel, the largest sum, to which all are lowered in proportion.
    """
    each = jnp.repeat(factors, 2).reshape((1,) * (currents.ndim - 1) + (6,))
    lowered = jnp.minimum(currents * each, panel_limit)
    total = jnp.sum(lowered, axis=-1, keepdims=True)
    # Without this the sum of dark panels would be divided by.
    over = total > sum_limit
    return lowered * jnp.where(over, sum_limit / jnp.where(over, total, 1.0), 1.0)


def current_readings(
    currents: Float[Array, "*batch 6"],
    *,
    sigma: float | Float[Array, ""],
    offset: float | Float[Array, ""],
    quantum: float,
    draw: Draw = jax.random.normal,
    key: PRNGKeyArray,
) -> Float[Array, "*batch 6"]:
    """Readings of currents in their unit: noise of `sigma` on panels that see light, `offset` on all of them.

    Rounded to whole steps of `quantum` unless it is zero; the telemetry has nothing below zero. A panel that sees no
    light and has no offset reads exactly zero.
    """
    noise = jnp.where(currents > 0.0, sigma * draw(key, currents.shape), 0.0)
    raw = currents + noise + offset
    return quantize(raw, quantum) if quantum > 0.0 else jnp.maximum(raw, 0.0)
