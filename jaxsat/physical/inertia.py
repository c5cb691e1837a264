"""Which tensors are the inertia of a body: the one check of settings, satellite files and the simulator."""

import numpy as np
from jaxtyping import Bool, Shaped

_SLACK = 1e-9
"""Relative rounding that is let pass in double precision."""


def check_inertia(inertia: Shaped[np.ndarray, "3 3"]) -> None:
    """Raise ValueError unless some body has this inertia tensor [kg m^2]; the limit, all mass in a plane, is one."""
    if not np.all(np.isfinite(inertia)):
        raise ValueError("inertia tensor is not finite")
    asymmetric, moments, slack = _measures(inertia)
    low, middle, high = moments.tolist()
    if asymmetric:
        raise ValueError("inertia tensor is not symmetric")
    if not low > 0.0:
        raise ValueError(f"inertia tensor is not positive definite: its smallest principal moment is {low:.6g} kg m2")
    if high > (low + middle) * (1.0 + slack):
        raise ValueError(
            f"no body has these principal moments of inertia: {high:.6g} exceeds the sum of {low:.6g} and "
            f"{middle:.6g} kg m2"
        )


def is_of_a_body(inertia: Shaped[np.ndarray, "*cases 3 3"]) -> Bool[np.ndarray, "*cases"]:
    """Whether `check_inertia` would let each of many tensors pass."""
    asymmetric, moments, slack = _measures(inertia)
    low, middle, high = np.moveaxis(moments, -1, 0)
    return np.isfinite(inertia).all(axis=(-2, -1)) & ~asymmetric & (low > 0.0) & (high <= (low + middle) * (1 + slack))


def _measures(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Whether each is asymmetric, its principal moments in rising order, and the rounding let pass."""
    slack = max(_SLACK, 16.0 * float(np.finfo(inertia.dtype).eps) if inertia.dtype.kind == "f" else 0.0)
    tensor = np.where(np.isfinite(inertia).all(axis=(-2, -1), keepdims=True), inertia, 0.0).astype(float)
    # Of the largest entry: products with rotations leave an entry that should be zero with rounding on either side.
    largest = np.abs(tensor).max(axis=(-2, -1))
    apart = np.abs(tensor - np.swapaxes(tensor, -2, -1)).max(axis=(-2, -1))
    return np.asarray(apart > slack * largest), np.linalg.eigvalsh(tensor), slack
