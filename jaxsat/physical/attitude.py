"""Which quaternions are attitudes: the one check of settings and the simulator."""

import numpy as np
from jaxtyping import Bool, Float, Shaped


def is_attitude(q: Shaped[np.ndarray, "*cases 4"]) -> Bool[np.ndarray, "*cases"]:
    """Whether a quaternion stands for an attitude: finite and not zero."""
    return np.asarray(np.isfinite(q).all(axis=-1) & (q != 0).any(axis=-1))


def unit_quaternion(q: Shaped[np.ndarray, "*cases 4"]) -> Float[np.ndarray, "*cases 4"]:
    """Return quaternions of length one, as any multiple of one is the same attitude; those of length one to the bit.

    What is no attitude becomes NaN.
    """
    q = q if q.dtype.kind == "f" else q.astype(float)
    attitude = is_attitude(q)[..., None]
    largest = np.abs(np.where(attitude, q, 1.0)).max(axis=-1, keepdims=True)
    # The squares of a very long or a very short one leave the range of numbers.
    scaled = np.where(attitude, q, np.nan) / largest
    length = largest * np.linalg.norm(scaled, axis=-1, keepdims=True)
    unit = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    return np.where(np.abs(length - 1.0) <= 4.0 * np.finfo(q.dtype).eps, q, unit).astype(q.dtype)
