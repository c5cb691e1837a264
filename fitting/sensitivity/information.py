"""What a fit would know: sigma from noise, sigma from what is only assumed, and what each assumed number costs.

Residuals r = r0 + J_f x + J_c c of unknowns x and considered numbers c, whitened, with weights W and priors of
information P on x: the estimate is off by x = C J_f^T W (n + J_c c) where C = (J_f^T W J_f + P)^-1, n is the noise and
c by what the considered numbers are wrong. Hence the covariance of noise, C, and that of what is assumed, S S^T with
the columns S = C J_f^T W J_c for one sigma of each (Bierman 1977, section VIII; Tapley, Schutz & Born 2004, sections
6.5 and 6.6). S is as well the bias of a wrong model to first order.
"""

from dataclasses import dataclass

import numpy as np

from fitting.outcome.uncertainty import covariance, propagated
from fitting.parameters.names import STATE
from fitting.parameters.quoted import quoted_names, quoted_slopes, quoted_units
from fitting.sensitivity.choice import Choice
from fitting.sensitivity.vantage import Slopes, Vantage


@dataclass(frozen=True)
class Known:
    """What is known of the fitted unknowns under a choice."""

    choice: Choice
    jacobian: np.ndarray
    """[samples channels fitted] by the fitted unknowns."""
    jacobian_considered: np.ndarray
    """[samples channels considered] for one sigma of each."""
    weight: np.ndarray
    """[samples channels]"""
    prior: np.ndarray
    """[fitted] information that the prior of each brings."""
    information: np.ndarray
    """[fitted fitted] of data and priors."""
    noise: np.ndarray
    """[fitted fitted] covariance from noise and priors; inf on the diagonal where nothing tells."""
    shift: np.ndarray
    """[fitted considered] by what one sigma of each considered number moves the estimate."""
    turn_by_free: np.ndarray
    """[samples 3 fitted] small turn of the attitude [rad]."""
    turn_of_motion: np.ndarray
    """[samples 3 considered] small turn of the motion itself for one sigma of each [rad]."""
    turn_by_considered: np.ndarray
    """[samples 3 considered] by what the estimated attitude is off for one sigma of each [rad]."""

    @property
    def total(self) -> np.ndarray:
        """[fitted fitted] covariance from noise and from what is only assumed."""
        return self.noise + self.shift @ self.shift.T


def known(vantage: Vantage, choice: Choice, slopes: Slopes | None = None) -> Known:
    """Linear algebra alone: `slopes` are those along the motion."""
    slopes = slopes or vantage.slopes
    J, by_considered = slopes.jacobian @ choice.free, slopes.jacobian @ choice.consider
    prior = (np.flatnonzero(choice.kept) >= len(STATE)).astype(float)
    weighted = J * slopes.weight[..., None]
    information = np.einsum("scu,scv->uv", weighted, J, optimize=True) + np.diag(prior)
    noise = covariance(information, np.ones(len(prior), bool), prior)
    finite = np.isfinite(np.diagonal(noise))
    shift = np.zeros((len(prior), by_considered.shape[-1]))
    pull = np.einsum("scu,sck->uk", weighted, by_considered, optimize=True)
    shift[finite] = noise[np.ix_(finite, finite)] @ pull[finite]
    turn = slopes.rotation @ choice.free
    return Known(
        choice=choice,
        jacobian=J,
        jacobian_considered=by_considered,
        weight=slopes.weight,
        prior=prior,
        information=information,
        noise=noise,
        shift=shift,
        turn_by_free=turn,
        turn_of_motion=slopes.rotation @ choice.consider,
        # What the estimate gains by moving, less what the motion itself does with the true number.
        turn_by_considered=turn @ shift - slopes.rotation @ choice.consider,
    )


@dataclass(frozen=True)
class Row:
    """One number as results quote it."""

    name: str
    unit: str
    value: float
    sigma_noise: float
    """From noise and the priors of what is fitted; inf where nothing tells."""
    sigma_assumed: float
    """From the considered numbers alone."""
    prior: float | None
    """1-sigma before any data; None for the state."""

    @property
    def sigma(self) -> float:
        """Of both."""
        return float(np.hypot(self.sigma_noise, self.sigma_assumed))


@dataclass(frozen=True)
class Quoted:
    """The fitted numbers in the units of results."""

    rows: tuple[Row, ...]
    slopes: np.ndarray
    """[rows fitted] of each by the fitted unknowns."""
    covariance: np.ndarray
    """[rows rows] from noise and what is assumed."""
    shift: np.ndarray
    """[rows considered] for one sigma of each considered number."""


def quoted(vantage: Vantage, found: Known) -> Quoted:
    """State and fitted leaves; a dipole that moves by its angles is quoted by them."""
    choice, parameters = found.choice, found.choice.parameters
    spread = quoted_slopes(parameters, choice.values_jacobian)[:, choice.kept]
    names, units = quoted_names(parameters), quoted_units(parameters)
    own = [k for k, name in enumerate(names) if name in choice.names]
    slopes = spread[own]
    noise, shift = propagated(slopes, found.noise), slopes @ found.shift
    rows = []
    for n, k in enumerate(own):
        leaf = None if k < len(STATE) else parameters.leaves[k - len(STATE)]
        value, prior = 0.0, None
        if leaf is not None:
            value = float(choice.values[k - len(STATE)] * leaf.to_unit)
            prior = float((leaf.loose if leaf.sigma is None else leaf.sigma) * leaf.to_unit)
        elif k >= 3:
            value = float(np.degrees(vantage.rate[k - 3]))
        assumed = float(np.sqrt((shift[n] ** 2).sum()))
        rows.append(Row(names[k], units[k], value, float(np.sqrt(noise[n, n])), assumed, prior))
    return Quoted(tuple(rows), slopes, noise + shift @ shift.T, shift)
