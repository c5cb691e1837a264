"""From sums over samples to sigmas, of many cases at once: arcs, intervals, scenarios.

What samples tell adds up: G = sum of [J_f J_c]^T W [J_f J_c] over any of them, and M = sum of [T_f T_c]^T [T_f T_c] of
the turns of the attitude, so that all that `fitting.sensitivity.information` says follows from two small matrices.
"""

from dataclasses import dataclass

import numpy as np

from fitting.outcome.uncertainty import LOST


@dataclass(frozen=True)
class Sigmas:
    """Of each case; arrays over the cases in front."""

    noise: np.ndarray
    """[... rows] of the quoted numbers from noise and priors; inf where nothing tells."""
    assumed: np.ndarray
    """[... rows] from the considered numbers."""
    attitude_noise: np.ndarray
    """[...] RMS over the arc of the attitude's 1-sigma, all three axes together [rad]."""
    attitude_assumed: np.ndarray
    """[...] the same from the considered numbers [rad]."""

    @property
    def total(self) -> np.ndarray:
        """[... rows]"""
        return np.hypot(self.noise, self.assumed)

    @property
    def attitude(self) -> np.ndarray:
        """[...] [rad]"""
        return np.asarray(np.hypot(self.attitude_noise, self.attitude_assumed))


def sigmas_of(told: np.ndarray, turned: np.ndarray, count: np.ndarray, prior: np.ndarray, slopes: np.ndarray) -> Sigmas:
    """Sigmas of cases with the sums `told` G and `turned` M, both [... n n] over fitted and considered columns.

    `count` [...] is over how many samples M was added up, `prior` [fitted] the information of the priors, `slopes`
    [rows fitted] those of the quoted numbers. Considered columns are for one sigma of each.
    """
    fitted = len(prior)
    information = told[..., :fitted, :fitted] + np.diag(prior)
    root = np.sqrt(np.maximum(np.einsum("...ii->...i", information), 1e-300))
    scaled = information / (root[..., :, None] * root[..., None, :])
    # Just above what rounding leaves, so that a singular one of many does not stop the rest.
    inverse = np.linalg.inv(scaled + 0.1 * LOST * np.eye(fitted))
    variance = np.einsum("...ii->...i", inverse)
    blind = ~((variance > 0.0) & (variance < 1.0 / LOST))
    # What nothing tells is told as such, and must not spoil what else is known.
    inverse = np.where(blind[..., :, None] | blind[..., None, :], 0.0, inverse)
    cov = inverse / (root[..., :, None] * root[..., None, :])
    noise = np.einsum("ri,...ij,rj->...r", slopes, cov, slopes, optimize=True)
    touched = np.any(blind[..., None, :] & (slopes != 0.0), axis=-1)
    shift = cov @ told[..., :fitted, fitted:]
    assumed = np.einsum("...rk->...r", (slopes @ shift) ** 2)
    turned = turned / np.maximum(count, 1)[..., None, None]
    of_noise = np.einsum("...ij,...ji->...", turned[..., :fitted, :fitted], cov)
    # Estimated less true attitude for one sigma of each: the estimate's own turn less that of the true number.
    own = np.broadcast_to(np.eye(told.shape[-1] - fitted), (*shift.shape[:-2], shift.shape[-1], shift.shape[-1]))
    error = np.concatenate([shift, -own], axis=-2)
    of_assumed = np.einsum("...ik,...ij,...jk->...", error, turned, error, optimize=True)
    unknown = blind.any(axis=-1) & (np.einsum("...ii->...i", turned)[..., :fitted] * blind > 0.0).any(axis=-1)
    return Sigmas(
        noise=np.where(touched, np.inf, np.sqrt(np.maximum(noise, 0.0))),
        assumed=np.where(touched, 0.0, np.sqrt(assumed)),
        attitude_noise=np.where(unknown, np.inf, np.sqrt(np.maximum(of_noise, 0.0))),
        attitude_assumed=np.where(unknown, 0.0, np.sqrt(np.maximum(of_assumed, 0.0))),
    )
