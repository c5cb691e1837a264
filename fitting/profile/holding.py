"""What is held along a profile: the parameter's own unknown, and under a gauge one more of those that scale with it."""

import numpy as np

from fitting.outcome.uncertainty import covariance
from fitting.parameters.free import MODULUS, FreeParameters
from fitting.parameters.names import STATE
from fitting.parameters.tree import Gauge
from jaxsat.errors import InputError
from jaxsat.satellites.model import INERTIA_PLACE, Leaf

FAITHFUL = 0.95
"""Share of the sigma that the held unknowns must account for; the interval is too narrow by as much."""


def choose_held(
    parameters: FreeParameters, name: str, slope: np.ndarray, hessian: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, float]:
    """Which unknowns [unknowns bool] are held so that the parameter is, and the 1-sigma of its own unknown.

    Under a gauge the parameter is its unknown divided by the modulus of the magnet, or by the mean of the gains: free
    to scale all of them, the others would undo any shift, so one of them is held too. The ratio of the two is held then
    instead of the value; what this costs is seen in the sigma along the way, and where it is too much, said. An entry
    of an inertia that stays that of a body is its own unknown near the nominal one; elsewhere the same check says so.
    `slope` [unknowns] is that of the parameter in its unit.
    """
    k = parameters.names.index(name)
    if "magnet" in parameters.gauged and k >= len(STATE) and _leaf(parameters, k).spot == MODULUS:
        raise InputError(f"{name} has no profile: it is held as gauge")
    gauge = _gauge_of(parameters, k)
    family = () if gauge is None else tuple(parameters.leaves[leaf].name for leaf in gauge.leaves)
    partners = [parameters.names.index(other) for other in family if other != name] or [k]
    whole = sigma_along(slope, covariance(hessian, free))
    choices = []
    for partner in partners:
        held = np.isin(np.arange(len(free)), [k, partner])
        cov = covariance(hessian, free & (~held | (np.arange(len(free)) == k)))
        spread = float(np.sqrt(cov[k, k]))
        if not 0.0 < spread < np.inf:
            raise InputError(f"the data say nothing of {name}: it has no profile")
        along = sigma_along(slope, np.outer(cov[:, k], cov[:, k]) / cov[k, k])
        choices.append((along or 0.0, held, spread))
    along, held, spread = max(choices, key=lambda choice: choice[0])
    if whole is not None and along < FAITHFUL * whole:
        raise InputError(f"{name} has no profile of its own, for {_why_not(parameters, k, gauge)}")
    return held, spread


def _leaf(parameters: FreeParameters, unknown: int) -> Leaf:
    return parameters.leaves[parameters.columns[unknown - len(STATE)]]


def _gauge_of(parameters: FreeParameters, unknown: int) -> Gauge | None:
    """The gauge that holds and has the leaf of this unknown in it."""
    leaf = parameters.columns[unknown - len(STATE)] if unknown >= len(STATE) else -1
    held = (gauge for gauge in parameters.tree.gauges if gauge.name in parameters.gauged)
    return next((gauge for gauge in held if leaf in gauge.leaves), None)


def _why_not(parameters: FreeParameters, unknown: int, gauge: Gauge | None) -> str:
    """What its value moves with."""
    if gauge is not None and gauge.name == "magnet":
        return "the magnet's modulus is held as gauge: profile a component across it, or do not free the inertia"
    if gauge is not None:
        return f"the mean of {gauge.name} is held as gauge: free either the gains or the largest current"
    if _leaf(parameters, unknown).place == INERTIA_PLACE:
        return "the entries of an inertia that stays that of a body move together: free this one alone"
    return "it moves together with others"


def sigma_along(slope: np.ndarray, cov: np.ndarray) -> float | None:
    """1-sigma of a number of this slope [unknowns]; None where there is none."""
    finite = np.isfinite(np.diagonal(cov))
    if np.any(slope[~finite] != 0.0):
        return None
    sigma = float(np.sqrt(slope[finite] @ cov[np.ix_(finite, finite)] @ slope[finite]))
    return sigma if 0.0 < sigma < np.inf else None
