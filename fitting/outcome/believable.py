"""What sigmas a fit may show: its covariance is that of its model, which a denied fit has not."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from fitting.outcome.result import FITS_ONLY, WRONG_MODEL, ChannelFit, FitResult, FittedParameter

NO_SIGMAS = "no sigmas are shown: they would be those of a model that is denied, or of no minimum"


def sigma_factor(verdict: str, channels: Mapping[str, ChannelFit], *, at_minimum: bool) -> float:
    """By what sigmas are multiplied: 1, how much farther than promised held-out readings are off, or infinity."""
    if verdict == WRONG_MODEL or not at_minimum:
        return np.inf
    if verdict != FITS_ONLY:
        return 1.0
    return max([1.0, *(c.holdout.sigma_ratio for c in channels.values() if c.holdout and not c.witness)])


def factor_remark(factor: float) -> tuple[str, ...]:
    """What is said of sigmas that are not those of the covariance."""
    if factor == 1.0:
        return ()
    if not np.isfinite(factor):
        return (NO_SIGMAS,)
    return (f"sigmas are {factor:.1f} times those of the covariance: as far off as what was held out",)


def widened(sigma: np.ndarray, factor: float) -> np.ndarray:
    """Sigmas so multiplied."""
    return sigma * factor if np.isfinite(factor) else np.full_like(sigma, np.inf)


def with_factor(table: tuple[FittedParameter, ...], factor: float) -> tuple[FittedParameter, ...]:
    """Parameters with their sigmas so multiplied; none where the factor is infinite."""
    return tuple(
        each
        if each.sigma is None
        else dataclasses.replace(each, sigma=each.sigma * factor if np.isfinite(factor) else None)
        for each in table
    )


def without_sigmas(result: FitResult) -> FitResult:
    """A result that is denied after all."""
    angle = result.field_angle_sigma_deg
    return dataclasses.replace(
        result,
        parameters=with_factor(result.parameters, np.inf),
        attitude_sigma_deg=widened(result.attitude_sigma_deg, np.inf),
        field_angle_sigma_deg=None if angle is None else widened(angle, np.inf),
        remarks=(*result.remarks, *factor_remark(np.inf)),
    )
