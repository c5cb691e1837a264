"""Which of a satellite's numbers are nowhere: zero, as their derivatives are, but for rounding.

Products with them are left out of a motion's right-hand side, half of which are of the inertia's off-diagonal elements.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsat.dynamics import RigidBody
from jaxsat.simulate.parts import Absent

DUST = 1e-13
"""Of the largest element of an array, below which one is rounding."""


def arrays_of(body: RigidBody) -> list[Array]:
    """All arrays of a satellite, in order."""
    return jax.tree.leaves(eqx.filter(body, eqx.is_array))


def nowhere(values: Sequence[Array], slopes: Sequence[Array]) -> Absent:
    """Of arrays over cases, which elements are nothing; the last axis of `slopes` is that of the unknowns."""
    pairs = ((_dust(v).all(axis=0), _dust(s).all(axis=(0, -1))) for v, s in zip(values, slopes, strict=True))
    return tuple(tuple((here & its_slope).reshape(-1).tolist()) for here, its_slope in pairs)


def present(arrays: Sequence[Array], absent: Absent) -> Float[Array, ""]:
    """The largest element that is thought absent, over the largest of its array; other axes come behind."""
    found = [jnp.zeros(())]
    for array, gone in zip(arrays, absent, strict=True):
        if any(gone):
            sizes = jnp.abs(array).reshape(len(gone), -1)
            largest = jnp.max(sizes)
            found.append(jnp.max(sizes[np.flatnonzero(gone)]) / jnp.where(largest > 0.0, largest, 1.0))
    return jnp.max(jnp.stack(found))


def _dust(array: Array) -> Bool[np.ndarray, "..."]:
    sizes = np.abs(np.asarray(array))
    largest = sizes.max(axis=tuple(range(1, sizes.ndim)), keepdims=True, initial=0.0)
    return sizes <= DUST * largest
