"""Angles of many pairs at once in NumPy, for work on the host: NaN stays NaN, and nothing is compiled."""

import numpy as np
from jaxtyping import Float


def angles_between(a: Float[np.ndarray, "n 3"], b: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
    """Angles between vectors in [0, pi] [rad]."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ni,ni->n", a, b))


def angle_between_attitudes(p: Float[np.ndarray, "... 4"], q: Float[np.ndarray, "... 4"]) -> Float[np.ndarray, "..."]:
    """Angles of the rotation from one attitude to the other [rad], to 1e-8 rad."""
    return 2.0 * np.arccos(np.clip(np.abs(np.sum(p * q, axis=-1)), 0.0, 1.0))
