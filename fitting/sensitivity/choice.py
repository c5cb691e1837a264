"""Which numbers are fitted, which are considered (not fitted, but uncertain), and which are taken for known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Array, Float

from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.transforms import dipole_from_polar_slopes
from fitting.parameters.tree import FreeLeaves
from fitting.sensitivity.vantage import Vantage
from fitting.stored import Stored
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import MAGNET_PLACE, POLAR_PLACE


@dataclass(frozen=True)
class Choice:
    """Columns that map the unknowns of a fit, and units of considered numbers, to all unknowns of `Slopes`."""

    parameters: FreeParameters
    """Those of the fit."""
    values: np.ndarray
    """[leaves] about which all is linear, SI."""
    values_jacobian: np.ndarray
    """[leaves unknowns] of all leaves, SI, by the fit's unknowns after the state, padding included."""
    kept: np.ndarray
    """[unknowns] bool: the fit's unknowns, state in front, without padding and without a state that is given."""
    free: np.ndarray
    """[all unknowns, fitted unknowns] of `kept` alone."""
    considered: tuple[str, ...]
    sigma: np.ndarray
    """[considered] their 1-sigma, SI."""
    consider: np.ndarray
    """[all unknowns, considered] for one sigma of each."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the fitted unknowns."""
        return tuple(name for name, kept in zip(self.parameters.names, self.kept, strict=True) if kept)


def choose(vantage: Vantage, free: Sequence[str] | None = None, consider: Sequence[str] = ()) -> Choice:
    """The choice of a user: names or prefixes as for a fit; of `consider` also NAME=SIGMA in the unit of results.

    Without `free` every number with a sigma is fitted but for those that are considered. Raises `InputError` for names
    that are none, for one that is both, and for a considered number without a sigma.
    """
    satellite, leaves = vantage.satellite, vantage.satellite.leaves
    sigmas = considered_sigmas(satellite, consider)
    names = named_free(satellite, free, sigmas)
    moves = vantage.free_motion
    parameters = free_parameters(satellite.model, leaves, names, free_motion=moves, held=satellite.held)
    slopes, values = vantage.slopes, np.array(vantage.parameters.tree.nominal, float)
    jacobian = _slopes_at(parameters, values)
    kept = parameters.everything
    columns = np.zeros((len(STATE) + len(slopes.leaves), len(kept)))
    columns[: len(STATE), : len(STATE)] = np.eye(len(STATE))
    columns[len(STATE) :, len(STATE) :] = jacobian[slopes.leaves] / slopes.scale[:, None]
    numbers = {leaves[k].name: place for place, k in enumerate(slopes.leaves)}
    found = np.zeros((len(columns), len(sigmas)))
    for column, (name, sigma) in enumerate(sigmas.items()):
        found[len(STATE) + numbers[name], column] = sigma / slopes.scale[numbers[name]]
    return Choice(
        parameters=parameters,
        values=values,
        values_jacobian=jacobian,
        kept=kept,
        free=columns[:, kept],
        considered=tuple(sigmas),
        sigma=np.array(list(sigmas.values())),
        consider=found,
    )


def _slopes_at(parameters: FreeParameters, values: np.ndarray) -> np.ndarray:
    """[leaves unknowns] about values of the leaves [SI]: those of a fit are not the nominal ones."""
    if np.array_equal(values, np.asarray(parameters.tree.nominal)):
        return slopes_at_nominal(parameters)
    return np.asarray(slopes_of(parameters.tree, parameters.shifts(values)))


def _slopes(tree: FreeLeaves, x: Float[Array, " unknowns"]) -> Float[Array, "leaves unknowns"]:
    return jax.jacfwd(tree.values)(x)


slopes_of = Stored(_slopes, seldom=True)


def slopes_at_nominal(parameters: FreeParameters) -> np.ndarray:
    """[leaves unknowns] of `FreeLeaves.values` at no shift, SI, on the host: no program for another choice.

    There the inertia moves by its own entries, a dipole by its angles or components, and what a gauge holds keeps its
    size: v -> v |v0| / |v| has the slopes 1 - u u^T, gains g mean0 / mean(g) those 1 - g 1^T / sum(g).
    """
    tree, leaves = parameters.tree, parameters.leaves
    nominal, found = np.asarray(tree.nominal, float), np.array(tree.tangent, float)
    magnet = [k for k, leaf in enumerate(leaves) if leaf.place == MAGNET_PLACE]
    polar = [k for k, leaf in enumerate(leaves) if leaf.place == POLAR_PLACE]
    if float(np.asarray(tree.by_angles)) > 0.0:
        found[magnet] = dipole_from_polar_slopes(nominal[polar]) @ found[polar]
    for gauge, on in zip(tree.gauges, np.asarray(tree.gauge_on), strict=True):
        if on <= 0.0:
            continue
        own = list(gauge.leaves)
        v = nominal[own]
        along = np.outer(v, v) / (v @ v) if gauge.name == "magnet" else np.outer(v, np.ones(len(v))) / v.sum()
        found[own] = (np.eye(len(v)) - along) @ found[own]
        if gauge.name == "magnet" and len(polar) == 3:
            found[polar[0]] = 0.0
    return found


def named_free(satellite: Satellite, free: Sequence[str] | None, considered: Mapping[str, float]) -> tuple[str, ...]:
    """Names of what is fitted: as asked for, or all with a sigma that are not considered; raises `InputError`."""
    names = chosen_leaves(satellite.leaves, free, satellite.aliases)
    both = [name for name in names if name in considered]
    if free is not None and both:
        raise InputError(f"{both[0]} is both fitted and considered: leave it out of one of them", field="consider")
    return tuple(name for name in names if name not in considered)


def considered_sigmas(satellite: Satellite, consider: Sequence[str]) -> dict[str, float]:
    """1-sigma of each considered leaf, SI, by name; raises `InputError`."""
    found = {}
    for item in (part.strip() for part in consider):
        name, equals, text = item.partition("=")
        try:
            wanted = chosen_leaves(satellite.leaves, [name.strip()], satellite.aliases)
        except InputError as error:
            raise InputError(error.reason.replace("free parameter", "number"), field="consider") from None
        for leaf in (leaf for leaf in satellite.leaves if leaf.name in wanted):
            if leaf.restates:
                raise InputError(f"{leaf.name} cannot be considered: it says what others say", field="consider")
            sigma = _number(text, item) / leaf.to_unit if equals else leaf.sigma
            if sigma is None:
                reason = f"{leaf.name} has no sigma in the satellite file: say one, as {leaf.name}=VALUE [{leaf.unit}]"
                raise InputError(reason, field="consider")
            found[leaf.name] = sigma
    return found


def _number(text: str, item: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(f"expected NAME=SIGMA with a positive number, found {item!r}", field="consider")
    return value
