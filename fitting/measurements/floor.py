"""Readings at the floor of the telemetry: currents that were measured as zero, and were that or less (Tobin 1958).

Noise takes a faint current below zero as often as above, but the telemetry has no numbers below zero. Taken for plain
measurements such readings make all faint light too bright, and the albedo factors are off by up to three sigmas.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

FAINT = 0.25
"""Currents below it [sigma] pull less and less: a panel that sees nothing at all reads zero without noise."""
NO_FLOOR = -jnp.inf
"""The floor of a reading above it."""


def at_floor(
    residual: Float[Array, "*shape"], floor: Float[Array, "*shape"]
) -> tuple[Float[Array, "*shape"], Float[Array, "*shape"], Float[Array, "*shape"]]:
    """Loss of residuals, half its slope and half its curvature: r^2, r and 1 where the floor is `NO_FLOOR`.

    Elsewhere the residual is the modelled current u > 0, `floor` what the reading may have been at most, all in sigmas:
    -2 log Phi(floor - u), from zero at u = 0. Where its curvature is negative, a little, that of the logarithm stands.
    """
    counted = floor > NO_FLOOR
    u = jnp.where(counted, residual, 1.0)
    square = u**2 + FAINT**2
    root = jnp.sqrt(square)
    soft, slope = u**2 / root, u * (square + FAINT**2) / (square * root)
    bend = FAINT**2 * jnp.maximum(2.0 * FAINT**2 - u**2, 0.0) / (square**2 * root)
    limit = jnp.where(counted, floor, 0.0)
    z = soft - limit
    log_below = jax.scipy.special.log_ndtr(-z)
    # Inverse Mills ratio, phi(z) / Phi(-z).
    pull = jnp.exp(-0.5 * z**2 - log_below) / jnp.sqrt(2.0 * jnp.pi)
    loss = 2.0 * (jax.scipy.special.log_ndtr(limit) - log_below)
    return (
        jnp.where(counted, loss, residual**2),
        jnp.where(counted, pull * slope, residual),
        jnp.where(counted, pull * ((pull - z) * slope**2 + bend), 1.0),
    )
