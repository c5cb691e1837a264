"""Sigmas of a fit whose residuals hang together within a pass: by how much whole passes pull at each number.

The information matrix takes residuals of neighbouring samples for independent. An attitude that is estimated on board
is off by the same angle for minutes, so its errors do not average out as the count of samples says. The sandwich
estimate (Liang & Zeger 1986) takes passes for independent instead: H^-1 (sum over passes of g g^T) H^-1, where g is
the sum of Jacobian times residual in a pass and H the information matrix.
"""

import jax
import numpy as np

from fitting.fitted import Fit
from fitting.outcome.looking import look
from fitting.outcome.uncertainty import covariance
from fitting.parameters.names import STATE

PASS_GAP_S = 1800.0
"""Samples farther apart than this belong to two passes."""


def passes(t_s: np.ndarray) -> np.ndarray:
    """[n] number of the pass of each sample."""
    return np.concatenate([[0], np.cumsum(np.diff(t_s) > PASS_GAP_S)])


def sandwich(information: np.ndarray, pulls: np.ndarray) -> np.ndarray:
    """Covariance of unknowns by the pulls [passes unknowns] and the inverse of the information matrix."""
    return information @ (pulls.T @ pulls) @ information


def clustered_sigmas(fit: Fit) -> dict[str, tuple[float, float]]:
    """1-sigma of each free number by its name, in its unit: by passes, and by samples as the covariance has it.

    A denied fit shows none by itself; here the model's are wanted, to see how much wider passes make them.
    """
    best, parameters, samples = fit.found.minima[0], fit.found.parameters, fit.found.samples
    point = jax.tree.map(lambda leaf: np.asarray(leaf)[0], best.refined.points)
    problem = best.problem
    last = int(np.flatnonzero(problem.valid)[-1])
    blocks = problem.grid.blocks_to(last)
    found = look(problem, parameters.tree, np.asarray(point.x), np.asarray(point.reference), blocks)
    residual, jacobian = (np.asarray(array) for array in found[:2])
    n = len(samples.t)
    each = np.einsum("sc,scu->su", (residual * np.asarray(point.weight))[:n], jacobian[:n])
    number = passes(samples.t)
    pulls = np.stack([each[number == k].sum(axis=0) for k in range(number[-1] + 1)])
    inverse = covariance(np.asarray(point.hessian), parameters.everything)
    variances = np.stack([np.diagonal(sandwich(inverse, pulls)), np.diagonal(inverse)], axis=1)
    scale = {leaf.name: leaf.to_unit for leaf in parameters.leaves}
    sigma = np.concatenate([np.zeros(len(STATE)), parameters.sigma()])
    names = zip(parameters.names, (np.sqrt(variances) * sigma[:, None]).tolist(), strict=True)
    return {name: (found[0] * scale[name], found[1] * scale[name]) for name, found in names if name in scale}
