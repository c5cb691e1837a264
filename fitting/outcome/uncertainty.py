"""1-sigma of parameters and attitude from the information matrix at a minimum (Cramer-Rao bound of the model)."""

import numpy as np

LOST = 1e-12
"""Eigenvalue of a scaled information matrix that rounding may have made."""
TOUCHED = 1e-4
"""Share of a direction's length below which it does not belong to an unknown."""


def covariance(information: np.ndarray, free: np.ndarray, prior: np.ndarray | None = None) -> np.ndarray:
    """Inverse of the information matrix over the unknowns that are `free` [bool]; zero rows for the others.

    `prior` [unknowns] is the part of the information on each that its prior has brought. Directions that the data do
    not see, or by less than rounding leaves, are known as well as by the priors; where these do not count either they
    get a variance of inf rather than a number that rounding made.
    """
    result = np.zeros_like(information)
    index = np.flatnonzero(free)
    matrix = information[np.ix_(index, index)]
    root = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(root, root))
    seen = values > LOST
    if prior is not None:
        square = (vectors / root[:, None]) ** 2
        known = prior[index] > 0.0
        held = ~seen & (np.linalg.norm(vectors[known], axis=0) > TOUCHED)
        values, seen = np.where(held, prior[index] @ square, values), seen | held
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T / np.outer(root, root)
    blind = np.any(np.abs(vectors[:, ~seen]) > TOUCHED, axis=1)
    inverse[blind, :], inverse[:, blind] = 0.0, 0.0
    inverse[blind, blind] = np.inf
    result[np.ix_(index, index)] = inverse
    return result


def at_bound(x: np.ndarray, gradient: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """[unknowns] whether the cost would have an unknown beyond its bound."""
    lower, upper = bounds
    return ((x <= lower + 1e-9) & (gradient > 0)) | ((x >= upper - 1e-9) & (gradient < 0))


def undamped_step(gradient: np.ndarray, cov: np.ndarray, pressed: np.ndarray) -> np.ndarray:
    """[unknowns] to the minimum that slopes promise; `cov` is the `covariance` of unknowns that are not `pressed`."""
    finite = np.isfinite(np.diagonal(cov)) & ~pressed
    step = np.zeros(len(finite))
    step[finite] = -cov[np.ix_(finite, finite)] @ np.asarray(gradient)[finite]
    return step


def promised_saving(gradient: np.ndarray, cov: np.ndarray, pressed: np.ndarray) -> float:
    """Cost that this step would still save."""
    return -0.5 * float(np.asarray(gradient) @ undamped_step(gradient, cov, pressed))


def propagated(slopes: np.ndarray, cov: np.ndarray) -> np.ndarray:
    """[rows rows] covariance of numbers with these slopes [rows unknowns]; inf where an unknown one moves them."""
    finite = np.isfinite(np.diagonal(cov))
    found = slopes[:, finite] @ cov[np.ix_(finite, finite)] @ slopes[:, finite].T
    blind = np.any(np.abs(slopes[:, ~finite]) > 0.0, axis=1)
    found[blind, :], found[:, blind] = 0.0, 0.0
    found[blind, blind] = np.inf
    return found


def correlations(names: list[str], cov: np.ndarray, free: set[str]) -> dict[str, dict[str, float]]:
    """Correlation coefficients between free parameters, each pair once, as {name: {later name: value}}."""
    sigma = np.sqrt(np.diagonal(cov))
    used = [k for k, name in enumerate(names) if name in free and 0 < sigma[k] < np.inf]
    return {
        names[a]: {names[b]: round(float(cov[a, b] / (sigma[a] * sigma[b])), 4) for b in used[n + 1 :]}
        for n, a in enumerate(used[:-1])
    }


def attitude_covariance(rotation_jacobian: np.ndarray, cov: np.ndarray) -> np.ndarray:
    """[samples 3 3] covariance of the small rotation in body axes at every sample [rad^2]; inf where it is unknown."""
    finite = np.isfinite(np.diagonal(cov))
    J = rotation_jacobian[..., finite]
    result = J @ cov[np.ix_(finite, finite)] @ np.swapaxes(J, -1, -2)
    blind = np.any(rotation_jacobian[..., ~finite] != 0.0, axis=(1, 2))
    result[blind] = np.inf
    return result


def field_angle_sigma(field_body: np.ndarray, rotation_covariance: np.ndarray) -> np.ndarray:
    """1-sigma of the angle between body x and the field [rad], from the rotation's covariance in body axes.

    Only the rotation about the normal of the plane of x and the field changes the angle; where the two are parallel
    the normal is undefined and the larger of the two transverse sigmas is returned; inf where the rotation is unknown.
    """
    normal = np.cross(np.array([1.0, 0.0, 0.0]), field_body)
    length = np.linalg.norm(normal, axis=-1)
    parallel = length < 1e-9 * np.linalg.norm(field_body, axis=-1)
    normal = normal / np.where(parallel, 1.0, length)[:, None]
    known = np.all(np.isfinite(rotation_covariance), axis=(1, 2))
    finite = np.where(known[:, None, None], rotation_covariance, 0.0)
    variance = np.einsum("si,sij,sj->s", normal, finite, normal)
    transverse = np.linalg.eigvalsh(finite[:, 1:, 1:])[:, -1]
    return np.where(known, np.sqrt(np.maximum(np.where(parallel, transverse, variance), 0.0)), np.inf)


def scatter_directions(jacobian: np.ndarray, cov: np.ndarray) -> float:
    """As how many independent errors of one size the sum of squares of predicted residuals scatters.

    With their `jacobian` [n unknowns] and the covariance of the fit they are noise of one sigma and what the fit leaves
    open, V = I + J C J^T: tr(V)^2 / tr(V^2) (Satterthwaite 1946).
    Unknowns that nothing tells, of infinite variance, are left out of both.
    """
    finite = np.isfinite(np.diagonal(cov))
    J, n = jacobian[:, finite], len(jacobian)
    open_ = cov[np.ix_(finite, finite)] @ (J.T @ J)
    total = n + np.trace(open_)
    return float(total**2 / (n + 2.0 * np.trace(open_) + np.sum(open_ * open_.T)))
