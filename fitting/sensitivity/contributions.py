"""What each channel, each part of the arc and each sample tells."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.measurements.groups import of_groups, over_columns
from fitting.sensitivity.information import Known, known, quoted
from fitting.sensitivity.vantage import Vantage


@dataclass(frozen=True)
class Contribution:
    """Of some of the readings."""

    name: str
    readings: int
    share: float
    """Of the unknowns that data and priors tell: trace of covariance times information, over their number."""
    attitude_deg: float
    """RMS 1-sigma of the attitude without them [deg]."""
    sigma: np.ndarray
    """[rows] 1-sigma of each quoted number without them."""


@dataclass(frozen=True)
class Contributions:
    """The shares of all channels, or of all parts, and of the priors add up to one."""

    channels: tuple[Contribution, ...]
    parts: tuple[Contribution, ...]
    priors: float
    """Share that is not the data's."""
    samples: np.ndarray
    """[samples] share of each sample."""
    at_s: np.ndarray
    """[samples] its time."""


def attitude_rms(found: Known) -> float:
    """RMS over the arc of the attitude's 1-sigma from noise and what is assumed, three axes together [rad]."""
    finite = np.isfinite(np.diagonal(found.noise))
    if np.any(found.turn_by_free[..., ~finite] != 0.0):
        return float("inf")
    T = found.turn_by_free[..., finite]
    noise = np.einsum("sku,uv,skv->s", T, found.noise[np.ix_(finite, finite)], T, optimize=True)
    return float(np.sqrt(np.mean(noise + (found.turn_by_considered**2).sum(axis=(1, 2)))))


def contributions(vantage: Vantage, found: Known, *, parts: int = 10) -> Contributions:
    """Of each channel and of so many parts of the arc, equally long."""
    groups, t = vantage.problem.groups, vantage.samples.t
    finite = np.isfinite(np.diagonal(found.noise))
    J, cov = found.jacobian[..., finite], found.noise[np.ix_(finite, finite)]
    leverage = found.weight * np.einsum("scu,uv,scv->sc", J, cov, J, optimize=True)
    told = of_groups(leverage, groups) / max(int(finite.sum()), 1)
    used = of_groups(found.weight > 0.0, groups)
    edges = np.linspace(t[0], t[-1], parts + 1)
    part = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, parts - 1)
    channels, pieces = [], []
    for number, group in enumerate(groups):
        if used[:, number].any():
            left = over_columns(np.broadcast_to(np.arange(len(groups)) != number, told.shape), groups)
            about = group.name, int(used[:, number].sum()), float(told[:, number].sum())
            channels.append(_without(vantage, found, left, *about))
    for number in range(parts):
        own = part == number
        if used[own].any():
            name = f"{edges[number]:.0f} to {edges[number + 1]:.0f} s"
            pieces.append(_without(vantage, found, ~own[:, None], name, int(used[own].sum()), float(told[own].sum())))
    of_samples = told.sum(axis=1)
    return Contributions(tuple(channels), tuple(pieces), 1.0 - float(of_samples.sum()), of_samples, t)


def _without(vantage: Vantage, found: Known, left: np.ndarray, name: str, readings: int, share: float) -> Contribution:
    slopes = vantage.slopes
    less = known(vantage, found.choice, replace(slopes, weight=slopes.weight * left))
    sigma = np.sqrt(np.diagonal(quoted(vantage, less).covariance))
    return Contribution(name, readings, share, float(np.degrees(attitude_rms(less))), sigma)
