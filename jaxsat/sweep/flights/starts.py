"""How a satellite is let go: any attitude, a rate in any direction, and what its rods bring along."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from jaxsat.math import quaternion, unit
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import lag_from_induction


def attitude_and_rate(
    key: Key[Array, ""], max_rate: float | Float[Array, ""]
) -> tuple[Float[Array, "4"], Float[Array, "3"]]:
    """Quaternion, uniform over all attitudes, and rate in body axes [rad/s].

    The rate's size is uniform up to the largest, its direction over all.
    """
    attitude, axis, size = jax.random.split(key, 3)
    q = quaternion.normalize(jax.random.normal(attitude, (4,)))
    return q, max_rate * jax.random.uniform(size) * unit(jax.random.normal(axis, (3,)))


def first_lag(
    spacecraft: Spacecraft, nominal: Spacecraft, q: Float[Array, "cases 4"], b_field_eci: Float[np.ndarray, "3"]
) -> Float[Array, "cases rods"] | None:
    """Lag of the hysteresis rods with the flux that their file says, in a field [T]; None without rods.

    Leaves of `spacecraft` are over the cases or as those of the `nominal` one.
    """
    if spacecraft.hysteresis_rods is None:
        return None

    def lag(rods, q):
        return lag_from_induction(rods, rods.induction, quaternion.rotate_inverse(q, jnp.asarray(b_field_eci)))

    pair = spacecraft.hysteresis_rods, nominal.hysteresis_rods
    rods = jax.tree.map(lambda leaf, like: jnp.broadcast_to(leaf, (len(q), *jnp.shape(like))), *pair)
    return jax.vmap(lag)(rods, q)
