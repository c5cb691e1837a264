"""Attitudes of many samples at once by all directions known in body and in inertial axes: Wahba's problem."""

import jax
import numpy as np
from jaxtyping import Array, Float
from scipy.spatial.transform import Rotation

from jaxsat.estimation.vectors import weighted_attitude

ON_ONE_LINE = 1e-10
"""Directions give no attitude where the least information about an axis is below this share of the most: they are
nearer to one line than 2 arc seconds."""


def quest(
    body: Float[Array, "*samples vectors 3"],
    eci: Float[Array, "*samples vectors 3"],
    weights: Float[Array, "*samples vectors"],
) -> Float[Array, "*samples 4"]:
    """Attitudes of least sum w_k |b_k - A r_k|^2 for unit directions, sample by sample; differentiable.

    The optimum of QUEST (Shuster & Oh 1981), taken as Davenport's eigenvector and not by their characteristic
    equation: that one loses its digits near a turn of 180 deg and this one does not. A weight of zero leaves a
    direction out, which must be finite all the same. `wahba` is the like for measured arrays with gaps.
    """
    solve = weighted_attitude
    for _ in weights.shape[:-1]:
        solve = jax.vmap(solve)
    return solve(body, eci, weights)


def wahba(
    body: Float[np.ndarray, "*samples vectors 3"],
    eci: Float[np.ndarray, "*samples vectors 3"],
    sigma: Float[np.ndarray, "*samples vectors"],
) -> tuple[Float[np.ndarray, "*samples 4"], Float[np.ndarray, "*samples 3 3"]]:
    """Attitudes of least squares (Wahba 1965), inertial from body, and covariances about the body axes [rad^2].

    By the singular values of Markley 1988, on the host, for any number of samples. `sigma` [rad] is the 1-sigma of a
    direction's angle, and its inverse square the weight. Vectors need not be units; one with a NaN in it, of length
    zero, or of a sigma that is not finite and positive is not measured. Where fewer than two are, or all lie on one
    line, attitude and covariance are NaN.

    The covariance is the inverse of sum (1 - b b^T)/sigma^2 (Shuster & Oh 1981, eq. 70) with b the inertial
    directions in body axes, as the directions outside have no errors.
    """
    inside, outside = _units(body), _units(eci)
    known = np.isfinite(inside).all(axis=-1) & np.isfinite(outside).all(axis=-1) & np.isfinite(sigma) & (sigma > 0.0)
    weight = np.where(known, 1.0 / np.where(known, sigma, 1.0) ** 2, 0.0)
    inside, outside = (np.where(known[..., None], vectors, 0.0) for vectors in (inside, outside))
    profile = np.einsum("...k,...ki,...kj->...ij", weight, outside, inside)
    u, _, vt = np.linalg.svd(profile)
    mirror = np.ones((*profile.shape[:-2], 3))
    mirror[..., 2] = np.linalg.det(u) * np.linalg.det(vt)
    attitude = (u * mirror[..., None, :]) @ vt
    information = np.sum(weight, axis=-1)[..., None, None] * np.eye(3)
    information = information - np.einsum("...k,...ki,...kj->...ij", weight, outside, outside)
    values = np.linalg.eigvalsh(information)
    told = (np.sum(known, axis=-1) > 1) & (values[..., 0] > ON_ONE_LINE * values[..., 2])
    inverse = np.linalg.inv(np.where(told[..., None, None], information, np.eye(3)))
    covariance = np.swapaxes(attitude, -1, -2) @ inverse @ attitude
    quaternions = Rotation.from_matrix(attitude.reshape(-1, 3, 3)).as_quat(scalar_first=True).reshape(*told.shape, 4)
    return np.where(told[..., None], quaternions, np.nan), np.where(told[..., None, None], covariance, np.nan)


def _units(vectors):
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0.0, length, np.nan)
