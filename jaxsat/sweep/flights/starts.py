"""How a satellite is let go: any attitude, a rate in any direction."""

import jax
from jaxtyping import Array, Float, Key

from jaxsat.math import quaternion, unit


def attitude_and_rate(
    key: Key[Array, ""], max_rate: float | Float[Array, ""]
) -> tuple[Float[Array, "4"], Float[Array, "3"]]:
    """Quaternion, uniform over all attitudes, and rate in body axes [rad/s].

    The rate's size is uniform up to the largest, its direction over all.
    """
    attitude, axis, size = jax.random.split(key, 3)
    q = quaternion.normalize(jax.random.normal(attitude, (4,)))
    return q, max_rate * jax.random.uniform(size) * unit(jax.random.normal(axis, (3,)))
