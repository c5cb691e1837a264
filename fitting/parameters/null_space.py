"""Combinations of parameters of which the data say nothing, or less than the priors, and what they are called.

Found from the information matrix: the state is eliminated, each unknown is counted in its prior sigma, and directions
of small eigenvalues are compared with those changes of a satellite that no reading tells.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fitting.parameters.free import FreeParameters
from fitting.parameters.invisible import PRIORS, invisible_changes
from fitting.parameters.names import STATE
from jaxsat.satellites.model import INERTIA_PLACE, Model

BLIND = 1e-3
"""Information of the data over that of the prior below which they say nothing: a sigma of thirty prior ones."""
WEAK = 1.0
"""The same below which the prior says more than the data."""
ALIKE = 0.9
"""Share of a known change's square that must lie in such directions for its name to be used."""
SHOWN = 0.25
"""Components of a unit direction below this are not named, but for the largest."""


@dataclass(frozen=True)
class Direction:
    """One combination of free parameters that the data hardly see, or do not."""

    name: str
    """`common scale of ...`, or the parameters of its largest components with their signs."""
    information: float
    """That of the data over that of the prior, 0 ... 1."""
    held_by: str
    components: dict[str, float]
    """Change of each parameter of note along it, one prior sigma long, in the unit of the parameter's name."""

    @property
    def blind(self) -> bool:
        """Whether the data say nothing of it."""
        return self.information < BLIND

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**asdict(self), "blind": self.blind}


def unseen_directions(
    parameters: FreeParameters,
    information: np.ndarray,
    free: np.ndarray,
    values: np.ndarray,
    values_jacobian: np.ndarray,
    model: Model,
) -> tuple[Direction, ...]:
    """Directions on which the priors say more than the data: those with a name, then the others, the weakest first.

    `information` [unknowns unknowns] is that of data and priors, `free` [unknowns] false for unknowns at a bound,
    `values` [leaves] and `values_jacobian` [leaves unknowns] by the unknowns after the state are those at the minimum,
    SI; `model` says what pushes the satellite beside them.
    """
    own = np.flatnonzero(free)
    own = own[own >= len(STATE)]
    if not len(own):
        return ()
    data = _without_state(information, own)
    eigenvalues, vectors = np.linalg.eigh(data)
    span = vectors[:, eigenvalues < WEAK]
    found = []
    for change in invisible_changes(parameters, values, model):
        x = _unit(_in_unknowns(parameters, change.values, values_jacobian)[own - len(STATE)])
        inside = span.T @ x
        if inside @ inside < ALIKE:
            continue
        found.append(_direction(parameters, own, span @ _unit(inside), data, change.held_by, change.name))
        # The rest is what lies across this one.
        q, _ = np.linalg.qr(np.column_stack([inside, np.eye(len(inside))]))
        span = span @ q[:, 1:]
    _, across = np.linalg.eigh(span.T @ data @ span)
    rest = (span @ across).T
    return (*found, *(_direction(parameters, own, vector, data, PRIORS) for vector in rest))


def gauge_text(directions: Sequence[Direction]) -> str | None:
    """What the data cannot see and what was held in its place, in one line; None where they see everything."""
    return "; ".join(f"{d.name} fixed by {d.held_by}" for d in directions if d.blind) or None


def _without_state(information: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Information of the data on the model's unknowns, whatever the state; eigenvalues of rounding may be below 0."""
    state = np.arange(len(STATE))
    own = information[np.ix_(model, model)] - np.eye(len(model))
    shared = information[np.ix_(model, state)]
    matrix = information[np.ix_(state, state)]
    root = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    inverse = np.linalg.pinv(matrix / np.outer(root, root), rcond=1e-12, hermitian=True) / np.outer(root, root)
    result = own - shared @ inverse @ shared.T
    return 0.5 * (result + result.T)


def _in_unknowns(parameters: FreeParameters, change: np.ndarray, values_jacobian: np.ndarray) -> np.ndarray:
    """[unknowns] after the state that change the free leaves so [leaves, SI], to first order.

    Those of a gauge that holds do so before they are scaled.
    """
    known = parameters.columns >= 0
    rows = parameters.columns[known]
    x = np.zeros(len(known))
    x[known] = change[rows] / parameters.sigma()[known]
    body = known & np.array([k >= 0 and parameters.leaves[k].place == INERTIA_PLACE for k in parameters.columns])
    if float(np.asarray(parameters.tree.keeps_body)) > 0.0:
        # Away from the nominal body its entries are not their own unknowns.
        slopes = values_jacobian[np.ix_(parameters.columns[body], np.flatnonzero(body))]
        x[body] = np.linalg.lstsq(slopes, change[parameters.columns[body]])[0]
    return x


def _direction(
    parameters: FreeParameters, own: np.ndarray, vector: np.ndarray, data: np.ndarray, held_by: str, name: str = ""
) -> Direction:
    """A unit vector over the unknowns of numbers `own`, on which the data's information is `data`, in words."""
    order = np.argsort(-np.abs(vector))
    vector = vector * np.sign(vector[order[0]])
    large = [int(k) for n, k in enumerate(order) if n == 0 or abs(vector[k]) > SHOWN]
    names, sigma = [parameters.names[k] for k in own], parameters.sigma()[own - len(STATE)]
    spelt = " ".join(f"{'+' if vector[k] > 0 else '-'} {names[k]}" for k in large).removeprefix("+ ")
    to_unit = [parameters.leaves[parameters.columns[k - len(STATE)]].to_unit for k in own]
    components = {names[k]: float(vector[k] * sigma[k] * to_unit[k]) for k in large}
    return Direction(name or spelt, max(float(vector @ data @ vector), 0.0), held_by, components)


def _unit(vector: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector
