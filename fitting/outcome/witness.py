"""A sensor that was not fitted, asked whether it agrees with the motion: by its size, and by where it would move it.

Readings of a witness may lie within their stated noise and still all pull one way. How the fit's own unknowns would
have to move for them is estimated with what the sensor's calibration may be wrong by, and compared with the covariance
of the fit: a right fit is moved as far as its sigmas say, one with late positions or a wrong year many times farther.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from fitting.outcome.result import ChannelFit, Holdout, Wish

MOST_LEFT_OUT = 0.25
"""Share of a channel's readings that may be left out."""
SPARE = 10
"""Readings that must be left to tell the noise of a witness by."""
SEEN = 0.02
"""Change of the readings [sigma] by one sigma of a combination of unknowns, below which it is not asked about."""
DOUBT = 1e-2
"""Probability of chi2 below which the fit itself gives reason to believe a witness that explains itself in part."""
EXPLAINED = 0.9
"""Share of the squares of its residuals that the wish explains where it is believed without."""


@dataclass(frozen=True)
class Witness:
    """What a sensor that was not fitted says."""

    name: str
    unit: str
    samples: int
    holdout: Holdout | None
    """Of all its readings; None where all are outliers."""
    wish: Wish | None = None

    @staticmethod
    def of(channel: ChannelFit) -> "Witness | None":
        """The channel as a witness; None where it is none, or has no reading."""
        if not channel.witness or not len(channel.used):
            return None
        return Witness(channel.name, channel.unit, len(channel.used), channel.holdout, channel.wish)

    @property
    def outliers(self) -> int:
        """Samples that no motion near this one makes."""
        return self.samples if self.holdout is None else self.holdout.outliers

    @property
    def denies(self) -> bool:
        """Whether it contradicts the motion: beyond what the fit promises, with too many outliers, or by its wish."""
        far = self.holdout is None or self.holdout.too_far
        return far or self.outliers > MOST_LEFT_OUT * self.samples or (self.wish is not None and self.wish.denies)

    @property
    def text(self) -> str:
        """What it says of the motion."""
        found, held = f"the witness {self.name} {'denies' if self.denies else 'confirms'} the motion", self.holdout
        if held is not None:
            found += (
                f": its readings are {held.rms:.2g} {self.unit} (RMS) off, {held.sigma_ratio:.1f} times what the fit "
                "and its noise promise"
            )
        if self.wish is not None and self.wish.denies:
            found += (
                f"; they would move the fit {self.wish.sigmas:.1f} times as far as its sigmas allow "
                f"(p = {self.wish.p:.1g})"
            )
        return found + (f"; {self.outliers} of {self.samples} are far off" if self.outliers else "")


def wish_of(
    residual: np.ndarray, slope: np.ndarray, cov: np.ndarray, calibration: np.ndarray, *, noise: float, chi2_p: float
) -> Wish | None:
    """How far readings of one sensor would move the unknowns; None where too few are left to tell their noise.

    `residual` [readings] is (measured - modelled) over sigma and `slope` [readings unknowns] the change of modelled for
    a unit of each unknown, whose covariance is `cov`; `calibration` [readings terms] is what may be wrong about the
    sensor, of any size; `noise` the least 1-sigma of a reading, over sigma; `chi2_p` the probability of the fit's own
    chi2.

    Least squares of r = A u + C c + e, where u are the combinations of unknowns in their own sigmas, of unit covariance
    if the fit is right. The noise is that of e, and u (1 + cov u)^-1 u then chi-square with as many degrees of freedom
    as combinations.
    """
    if len(residual) < SPARE:
        return None
    values, vectors = np.linalg.eigh(cov)
    left, size, _ = np.linalg.svd(slope @ (vectors * np.sqrt(np.maximum(values, 0.0))), full_matrices=False)
    seen = size > SEEN
    count = int(seen.sum())
    design = np.hstack([left[:, seen] * size[seen], calibration / np.maximum(np.abs(calibration).max(axis=0), 1e-300)])
    freedom = len(residual) - np.linalg.matrix_rank(design)
    if count == 0 or freedom < SPARE:
        return None
    inverse = np.linalg.pinv(design, rcond=1e-10)
    found = inverse @ residual
    rest = residual - design @ found
    sigma = max(float(np.sqrt(rest @ rest / freedom)), noise)
    spread = np.eye(count) + sigma**2 * (inverse @ inverse.T)[:count, :count]
    strength = float(found[:count] @ np.linalg.solve(spread, found[:count]))
    # What the calibration alone would leave.
    alone = residual - calibration @ np.linalg.lstsq(calibration, residual, rcond=1e-10)[0]
    explained = 1.0 - float(rest @ rest) / max(float(alone @ alone), 1e-300)
    believed = explained > EXPLAINED or chi2_p < DOUBT
    return Wish(count, strength, float(chdtrc(count, strength)), explained, believed)
