"""What it costs that a magnet's axis is not on the field's line, as `roll_minima` takes it to be.

The residuals tell how far off it is: where the axis is turned across the field by small angles of 1-sigma s, the
squares that the best roll and factors leave grow by s^2 |Q J|^2, with J the residuals' slopes by such turns and Q the
projection across the slope by the roll (a variance component by moments, Searle, Casella & McCulloch 1992, ch. 5).
"""

import numpy as np
from jaxtyping import Bool, Float

ROLL_AND_FACTORS = 3
"""Unknowns of a sample."""


def axis_off(
    slopes: Float[np.ndarray, "n panels 3"],
    squares: Float[np.ndarray, " n"],
    axis: Float[np.ndarray, "3"],
    noise: float,
) -> float:
    """1-sigma of each of the two angles across the field, by samples together [rad]; zero where noise explains all.

    `slopes` are those of the residuals by turns about the body axes [A/rad], `squares` their sums [A^2].
    """
    if not len(slopes):
        return 0.0
    freedom = slopes.shape[1] - ROLL_AND_FACTORS
    across, roll, _ = _parts(slopes, axis)
    size = np.maximum(np.sum(roll**2, axis=1), 1e-300)
    left = across - roll[:, :, None] * (np.einsum("np,npk->nk", roll, across) / size[:, None])[:, None]
    seen = float(np.sum(left**2))
    excess = float(np.sum(squares - freedom * noise**2))
    return float(np.sqrt(excess / seen)) if excess > 0.0 and seen > 0.0 else 0.0


def roll_sigma(
    slopes: Float[np.ndarray, "*n panels 3"],
    axis: Float[np.ndarray, "3"],
    noise: float,
    off: float,
    seen: Bool[np.ndarray, "*n"],
) -> Float[np.ndarray, "*n"]:
    """1-sigma about the least seen axis [rad]: noise in the roll, the axis off by `off`, and the roll that follows it.

    Infinite where the roll is not `seen`.
    """
    across, roll, basis = _parts(slopes, axis)
    size = np.where(seen, np.sum(roll**2, axis=-1), 1.0)
    follows = np.einsum("...p,...pk->...k", roll, across) / size[..., None]
    moved = basis - follows[..., None, :] * axis[:, None]
    covariance = off**2 * moved @ np.swapaxes(moved, -1, -2) + (noise**2 / size)[..., None, None] * np.outer(axis, axis)
    sigma = np.sqrt(np.max(np.linalg.eigvalsh(np.where(seen[..., None, None], covariance, 0.0)), axis=-1))
    return np.where(seen, sigma, np.inf)


def _parts(slopes, axis):
    """Slopes by turns across the axis [... panels 2] and about it [... panels], and the two directions across [3 2]."""
    basis = np.linalg.svd(axis[None])[2][1:].T
    return slopes @ basis, slopes @ axis, basis
