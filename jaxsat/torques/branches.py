"""The law of hysteresis along one branch, in a variable that is never stiff.

While the field along a rod rises, or falls, its lag z nears the boundary loop ahead: with F = (1 + z s) / 2, s the sign
of dH/dt, (1 - F)' = -(1 - q0) (1 - F^p) s H' / (2 Hc). In a loop that is narrow against the swing of the field that is
a fast decay. Its logarithm y = -ln(1 - F), the nearness, grows at a rate between one and p times (1 - q0) s H' / (2 Hc)
instead. Where the field turns, F becomes 1 - F. What stands beyond the loop ahead (F > 1) stands still until then.
"""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.spacecraft import HysteresisRods
from jaxsat.torques.hysteresis import field_along_rods, steepness

CLOSEST = 80.0
"""Nearness of a rod on the loop."""

Rods = Float[Array, "*cases rods"]


def nearness_from_lag(lag: Rods, rising: Bool[Array, "*cases rods"]) -> tuple[Rods, Rods]:
    """Nearness on a branch, and by how much F is beyond one."""
    return _nearness(0.5 * (1.0 - jnp.where(rising, lag, -lag)))


def lag_from_nearness(nearness: Rods, beyond: Rods, rising: Bool[Array, "*cases rods"]) -> Rods:
    """Lag on a branch."""
    ahead = 2.0 * (1.0 - _ahead(nearness) + beyond) - 1.0
    return jnp.where(rising, ahead, -ahead)


def nearness_after_turn(nearness: Rods, beyond: Rods) -> tuple[Rods, Rods]:
    """The same rods on the other branch: what was behind is ahead."""
    return _nearness(-jnp.expm1(-nearness) + beyond)


def _nearness(ahead: Rods) -> tuple[Rods, Rods]:
    """Of rods at a distance 1 - F from the loop ahead."""
    return -jnp.log(jnp.maximum(ahead, jnp.exp(-CLOSEST))), jnp.maximum(-ahead, 0.0)


def _ahead(nearness: Rods) -> Rods:
    """1 - F, but for what is beyond one."""
    return jnp.exp(-jnp.minimum(nearness, CLOSEST))


def nearness_slope(rods: HysteresisRods, nearness: Float[Array, " rods"]) -> Float[Array, " rods"]:
    """Change of the nearness with s H [1/(A/m)]: (1 - q0) / (2 Hc) times (1 - F^p) / (1 - F), F not below zero."""
    ahead = _ahead(nearness)
    inside = ahead < 1.0
    log_behind = jnp.log1p(-jnp.where(inside, ahead, 0.5))
    share = jnp.where(inside, -jnp.expm1(rods.exponent * log_behind), 1.0)
    return (1.0 - rods.initial_slope) / (2.0 * rods.coercive_field) * share / ahead


def heating(
    rods: HysteresisRods,
    nearness: Float[Array, " rods"],
    lag: Float[Array, " rods"],
    b_field_body: Float[Array, "3"],
    field_rate: Float[Array, " rods"],
) -> Float[Array, " rods"]:
    """Power that the field's change along each rod [A/m/s] puts into it, V H dB/dt [W]; all of it heat over a loop."""
    field, k = field_along_rods(rods, b_field_body), steepness(rods)
    slope = 2.0 / jnp.pi * rods.saturation * k / (1.0 + (k * (field - rods.coercive_field * lag)) ** 2)
    lag_share = 2.0 * rods.coercive_field * nearness_slope(rods, nearness) * _ahead(nearness)
    return rods.volumes * field * slope * (1.0 - lag_share) * field_rate
