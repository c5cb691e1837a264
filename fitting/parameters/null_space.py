"""Combinations of parameters of which the data say nothing, or less than the priors, and what they are called.

Found from the information matrix: the state is eliminated, each unknown is counted in its prior sigma, and directions
of small eigenvalues are compared with those changes of a satellite that no panel can see.
"""

from dataclasses import asdict, dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting.parameters.names import GAINS, INERTIA, MAGNET, MODEL, NAMED, POLAR, RODS, STATE, TILTS, TO_UNIT
from fitting.parameters.parametrization import (
    GAINS_SLICE,
    INERTIA_SLICE,
    MAGNET_SLICE,
    RODS_SLICE,
    TILTS_SLICE,
    Parametrization,
)
from fitting.parameters.transforms import ENTRIES, polar_from_dipole, tensor_of

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
    parameters: Parametrization, information: np.ndarray, free: np.ndarray, values: np.ndarray
) -> tuple[Direction, ...]:
    """Directions on which the priors say more than the data: those with a name, then the others, the weakest first.

    `information` [unknowns unknowns] is that of data and priors, `free` [unknowns] false for unknowns at a bound,
    `values` [model] those at the minimum.
    """
    model = np.flatnonzero(free)
    model = model[model >= len(STATE)]
    if not len(model):
        return ()
    data = _without_state(information, model)
    eigenvalues, vectors = np.linalg.eigh(data)
    span = vectors[:, eigenvalues < WEAK]
    names = [parameters.names[k] for k in model]
    found = []
    for name, held_by, change in _invisible_changes(parameters, values):
        x = _unit((change / np.asarray(parameters.scale))[[NAMED.index(free_name) for free_name in names]])
        inside = span.T @ x
        if inside @ inside < ALIKE:
            continue
        direction = span @ _unit(inside)
        found.append(_direction(parameters, names, direction, data, held_by, name))
        # The rest is what lies across this one.
        q, _ = np.linalg.qr(np.column_stack([inside, np.eye(len(inside))]))
        span = span @ q[:, 1:]
    _, across = np.linalg.eigh(span.T @ data @ span)
    rest = (span @ across).T
    return (*found, *(_direction(parameters, names, vector, data, "the priors") for vector in rest))


def gauge_text(directions: tuple[Direction, ...]) -> str | None:
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


def _invisible_changes(parameters: Parametrization, values: np.ndarray) -> list[tuple[str, str, np.ndarray]]:
    """(name, what holds it, change [named]) of what may be invisible with these free parameters, to first order."""
    free = set(parameters.free)
    found: list[tuple[str, str, np.ndarray]] = []
    dipole = free & {*MAGNET, POLAR[0]}
    if free & set(INERTIA) and (dipole or free & set(RODS)):
        groups = [name for name, there in (("magnet", dipole), ("rods", free & set(RODS))) if there]
        change = np.zeros(len(NAMED))
        # Under a gauge the parametrization rescales the magnet alone, so that its length is what does not count.
        for part in (MAGNET_SLICE,) if parameters.gauged else (MAGNET_SLICE, RODS_SLICE, INERTIA_SLICE):
            change[part] = values[part]
        modulus = float(np.linalg.norm(values[MAGNET_SLICE]))
        change[NAMED.index(POLAR[0])] = modulus
        held = f"|magnet| = {modulus:.6g} A m2" if parameters.gauged else "the priors"
        found.append((f"common scale of {' and '.join(', '.join(['inertia', *groups]).rsplit(', ', 1))}", held, change))
    if "imax" in free and set(GAINS) <= free:
        change = np.zeros(len(NAMED))
        change[MODEL.index("imax")] = 0.0 if parameters.gains_gauged else values[MODEL.index("imax")]
        change[GAINS_SLICE] = -values[GAINS_SLICE]
        held = f"the mean gain = {values[GAINS_SLICE].mean():.6g}" if parameters.gains_gauged else "the priors"
        found.append(("common scale of gains and imax", held, change))
    if free & set(TILTS):
        found += [(f"common turn of the panels about {axis}", "the priors", _turn(values, axis)) for axis in "xyz"]
    return found


def _turn(values: np.ndarray, axis: str) -> np.ndarray:
    """Change [named] of a satellite whose every vector and tensor but the rods' axes turn about a body axis, a radian.

    The attitude turns back, so that panels, dipole and inertia stay where they are in space.
    """
    change = np.zeros(len(NAMED))
    unit = np.eye(3)["xyz".index(axis)]
    magnet = values[MAGNET_SLICE]
    change[MAGNET_SLICE] = np.cross(unit, magnet)
    if np.any(magnet):
        slope = jax.jvp(polar_from_dipole, (jnp.asarray(magnet),), (jnp.asarray(change[MAGNET_SLICE]),))[1]
        change[len(MODEL) :] = np.asarray(slope)
    tensor = tensor_of(values[INERTIA_SLICE])
    matrix = np.cross(np.eye(3), unit)
    turned = matrix @ tensor - tensor @ matrix
    change[INERTIA_SLICE] = turned[ENTRIES]
    change[TILTS_SLICE] = [float(name.endswith(f".{axis}")) for name in TILTS]
    return change


def _direction(
    parameters: Parametrization, names: list[str], vector: np.ndarray, data: np.ndarray, held_by: str, name: str = ""
) -> Direction:
    """A unit vector over the unknowns `names`, on which the data's information is `data`, in words and units."""
    order = np.argsort(-np.abs(vector))
    vector = vector * np.sign(vector[order[0]])
    large = [int(k) for n, k in enumerate(order) if n == 0 or abs(vector[k]) > SHOWN]
    spelt = " ".join(f"{'+' if vector[k] > 0 else '-'} {names[k]}" for k in large).removeprefix("+ ")
    components = {}
    for k in large:
        sigma = float(np.asarray(parameters.scale)[NAMED.index(names[k])])
        components[names[k]] = float(vector[k]) * sigma * TO_UNIT.get(names[k], 1.0) * parameters.quoted(names[k])
    return Direction(name or spelt, max(float(vector @ data @ vector), 0.0), held_by, components)


def _unit(vector: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector
