"""How much of a fit its data tell, how much of their noise it copies, and whether it can predict what comes next.

Whitened readings y = J x + n with priors of information P on x: the fit C J^T W y, C = (J^T W J + P)^-1, has the hat
matrix H = J C J^T W. Averaged over noise and over numbers as the priors have them, the squares of what the fit leaves
sum up to n - tr H, those of its own error at the readings to tr H, and a reading j that it has not seen is missed by
1 + j C j^T (Hoaglin & Welsch 1978 on H; Efron 2004 on what a fit gains by having seen the data). What the fit leaves
and what it is wrong by are then independent: both are normal, and their covariance is zero.
"""

from dataclasses import dataclass

import numpy as np

from fitting.outcome.uncertainty import covariance
from fitting.sensitivity.information import Known

TELLS = 1e-6
"""Share of a reading's noise below which its value does not enter the fit: a panel in the dark."""

PREDICTS = 0.51
"""Sigma, over the noise, of a normal error that stays below the noise with 95 %: 1/1.96."""


@dataclass(frozen=True)
class Told:
    """Of one fit."""

    unknowns: int
    """That are free, without those that hold a size by definition."""
    by_data: float
    """tr H: as many of them as the data tell; the rest is what the priors say."""
    readings: int
    """That move the fit at all."""
    ahead: float
    """RMS 1-sigma of readings that the fit has not seen, by the fit's own error, over their noise."""

    @property
    def copied(self) -> float:
        """Share of the noise's square that the fit takes for signal: 1 where it goes through every reading."""
        return self.by_data / max(self.readings, 1)

    @property
    def missed(self) -> float:
        """Expected RMS of readings that it has not seen, over their noise."""
        return float(np.hypot(1.0, self.ahead))

    @property
    def predicts(self) -> bool:
        """Whether its own error in readings that it has not seen stays below their noise, 19 times of 20."""
        return self.ahead <= PREDICTS

    @property
    def tuned(self) -> bool:
        """Whether its own error there is expected above the noise, which agreement with what it has seen hides."""
        return self.ahead >= 1.0


def leverages(jacobian: np.ndarray, weight: np.ndarray, cov: np.ndarray) -> np.ndarray:
    """[...] diagonal of the hat matrix, of readings with whitened `jacobian` [... unknowns] and these weights [...].

    `cov` [unknowns unknowns] is that of noise and priors; unknowns of infinite variance are left out.
    """
    finite = np.isfinite(np.diagonal(cov))
    J = jacobian[..., finite]
    return weight * np.einsum("...u,uv,...v->...", J, cov[np.ix_(finite, finite)], J, optimize=True)


def told(
    jacobian: np.ndarray, weight: np.ndarray, cov: np.ndarray, later: np.ndarray, *, unknowns: int | None = None
) -> Told:
    """Of a fit to readings with whitened `jacobian` [... unknowns] and `weight` [...], by its covariance `cov`.

    `later` [... bool] marks readings that the fit has not seen, of which those that the numbers move at all count; they
    have no weight. `unknowns` is the number of free ones where it is not that of the columns. An unknown that nothing
    tells makes the prediction infinitely uncertain where it moves the readings. Raises ValueError where a reading is
    both seen and later.
    """
    if np.any(later & (weight > 0.0)):
        raise ValueError("a reading is marked as later and has a weight: it cannot be both fitted and predicted")
    leverage = leverages(jacobian, weight, cov)
    ahead = leverages(jacobian, later.astype(float), cov)
    blind = ~np.isfinite(np.diagonal(cov))
    ahead = np.where(later & np.any(jacobian[..., blind] != 0.0, axis=-1), np.inf, ahead)
    seen = ahead[later & (np.abs(jacobian).max(axis=-1, initial=0.0) > 0.0)]
    return Told(
        unknowns=len(cov) if unknowns is None else unknowns,
        by_data=float(leverage.sum()),
        readings=int((leverage > TELLS).sum()),
        ahead=float(np.sqrt(seen.mean())) if seen.size else 0.0,
    )


def told_without_end(found: Known, t: np.ndarray, *, share: float = 0.1) -> Told:
    """Of a fit of all but the last `share` of the time, which it would have to predict, by derivatives that are there.

    `t` [samples] rises. Raises ValueError for a share that leaves nothing on one side.
    """
    end = t[-1] - share * (t[-1] - t[0])
    before = (t <= end)[:, None] & (found.weight > 0.0)
    later = ~(t <= end)[:, None] & (found.weight > 0.0)
    if not (0.0 < share < 1.0 and before.any() and later.any()):
        raise ValueError(f"share must leave readings to fit and readings to predict, got {share:g}")
    weight = np.where(before, found.weight, 0.0)
    data = np.einsum("scu,sc,scv->uv", found.jacobian, weight, found.jacobian, optimize=True)
    cov = covariance(data + np.diag(found.prior), np.ones(len(data), bool), found.prior)
    unknowns = len(data) - len(found.choice.parameters.gauged)
    return told(found.jacobian, weight, cov, later, unknowns=unknowns)
