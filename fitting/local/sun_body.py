"""Directions of the Sun in body axes that six currents of a box allow."""

import itertools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsat.math import unit

SIDES = np.array(list(itertools.product((True, False), repeat=3)))
"""[8 3] which panel of each pair the Sun lights: True is the positive one."""


def sun_on_sides(currents: Float[Array, "6"], positive: Bool[Array, "3"]) -> Float[Array, "3"]:
    """Rough direction of the Sun in body axes when its light falls on the given panel of each pair +X -X +Y -Y +Z -Z.

    The other panel of each pair then holds light of the Earth only. Exact without albedo; 10 to 20 deg off with it.
    """
    return unit(jnp.where(positive, currents[0::2], -currents[1::2]))


def possible_sides(currents: np.ndarray, threshold: float) -> np.ndarray:
    """[samples 8] which of `SIDES` the currents [samples 6] allow, `threshold` [A] being the least that counts.

    The Sun lights one panel of each pair. Where both show light, either may be its own and the other the Earth's; where
    one or none does, it is the stronger one.
    """
    plus, minus = currents[:, 0::2], currents[:, 1::2]
    both = (plus >= threshold) & (minus >= threshold)
    stronger = plus >= minus
    return np.all(both[:, None] | (stronger[:, None] == SIDES[None]), axis=-1)
