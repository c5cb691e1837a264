"""The worst known combinations of numbers, in words, and whether the picture about them is linear."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.parameters.names import STATE
from fitting.sensitivity.information import Known
from fitting.sensitivity.vantage import Vantage
from jaxsat.errors import InputError

NAMED, TOGETHER, PARALLEL = 0.05, 0.25, 0.95
"""Share of a direction below which a part is not named; difference of relative changes up to which parts scale
together; cosine with its own values above which a part is scaled."""
SECOND_ORDER = 0.25
"""Change of second order over that of first order, up to which a picture is called linear."""


@dataclass(frozen=True)
class Worst:
    """A unit direction over the fitted numbers, each counted in its prior sigma."""

    words: str
    sigma: float
    """Along it, in prior sigmas: 1 where the data say nothing."""
    components: dict[str, float]
    """Change of each number for one sigma along it, in its unit."""


@dataclass(frozen=True)
class Linearity:
    """How far the quadratic picture holds along one direction (Bates & Watts 1980, relative curvature)."""

    words: str
    second_order: float
    """Change of the residuals that is not linear, for a step of one sigma, over the linear one."""

    @property
    def holds_to(self) -> float:
        """Sigmas up to which the change of second order is below `SECOND_ORDER` of the linear one."""
        return SECOND_ORDER / max(self.second_order, 1e-12)


def worst_directions(found: Known, *, count: int = 3) -> tuple[Worst, ...]:
    """Those with the largest sigma, priors, noise and what is assumed together."""
    own = np.flatnonzero((found.prior > 0.0) & np.isfinite(np.diagonal(found.noise)))
    if not len(own):
        return ()
    values, vectors = np.linalg.eigh(found.total[np.ix_(own, own)])
    worst = []
    for k in np.argsort(-values)[:count]:
        vector = np.zeros(len(found.prior))
        vector[own] = vectors[:, k]
        vector *= np.sign(vector[np.argmax(np.abs(vector))])
        sigma = float(np.sqrt(values[k]))
        worst.append(Worst(in_words(found, vector), sigma, _components(found, vector * sigma)))
    return tuple(worst)


def linearity(vantage: Vantage, found: Known, *, count: int = 3) -> tuple[Linearity, ...]:
    """Steps of one sigma both ways along the weakest directions of the information, taken with the full model.

    A step x with x^T I x = 1 changes residuals and priors together by a length of 1 to first order; what the full model
    changes them by beyond that is of second order and more.
    """
    slopes, choice = vantage.slopes, found.choice
    finite = np.flatnonzero(np.isfinite(np.diagonal(found.noise)))
    matrix = found.information[np.ix_(finite, finite)]
    root = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(root, root))
    weight = np.sqrt(np.maximum(slopes.weight, 0.0))
    tried = []
    for k in range(min(count, len(values))):
        step = np.zeros(len(found.prior))
        step[finite] = vectors[:, k] / root / np.sqrt(max(values[k], 1e-300))
        linear = found.jacobian @ step
        full = choice.free @ step
        shifts = dict(zip(slopes.leaves.tolist(), full[len(STATE) :] * slopes.scale, strict=True))
        off = []
        for sign in (1.0, -1.0):
            try:
                moved = vantage.at(sign * full[: len(STATE)], {n: sign * shift for n, shift in shifts.items()})
            except InputError:
                off.append(np.inf)
                continue
            off.append(float(np.linalg.norm(weight * (moved.residual - slopes.residual - sign * linear))))
        tried.append(Linearity(in_words(found, step), max(off)))
    return tuple(tried)


def linearity_of_bias(vantage: Vantage, found: Known, *, count: int = 3) -> tuple[Linearity, ...]:
    """The same of what considered numbers do: of those that move the estimate most, one sigma off both ways.

    The full model of estimate and truth, off by S and by one sigma, differs from the linear one by d; what d moves the
    estimate by, C J^T W d, is compared with S, both in the measure of the information.
    """
    slopes, choice = vantage.slopes, found.choice
    finite = np.flatnonzero(np.isfinite(np.diagonal(found.noise)))
    cov, information = found.noise[np.ix_(finite, finite)], found.information[np.ix_(finite, finite)]
    J = found.jacobian[..., finite]
    moved = found.shift[finite]
    lengths = np.sqrt(np.einsum("uk,uv,vk->k", moved, information, moved))
    tried = []
    for k in [int(k) for k in np.argsort(-lengths)[:count] if lengths[k] > 0.0]:
        full = choice.free @ found.shift[:, k] - choice.consider[:, k]
        linear = found.jacobian @ found.shift[:, k] - found.jacobian_considered[..., k]
        off = []
        for sign in (1.0, -1.0):
            shifts = dict(zip(slopes.leaves.tolist(), sign * full[len(STATE) :] * slopes.scale, strict=True))
            try:
                d = vantage.at(sign * full[: len(STATE)], shifts).residual - slopes.residual - sign * linear
            except InputError:
                off.append(np.inf)
                continue
            again = cov @ np.einsum("scu,sc,sc->u", J, slopes.weight, d, optimize=True)
            off.append(float(np.sqrt(again @ information @ again) / lengths[k]))
        tried.append(Linearity(f"{choice.considered[k]}, considered", max(off)))
    return tuple(tried)


def in_words(found: Known, vector: np.ndarray) -> str:
    """What a direction [fitted] does: which parts scale together, and what else moves with them."""
    choice, parameters = found.choice, found.choice.parameters
    model = found.prior > 0.0
    square = vector**2 * model
    if square.sum() < NAMED * (vector**2).sum():
        return "attitude and rate at the start"
    vector = vector * np.sign(vector[np.argmax(square)])
    columns = parameters.columns[np.flatnonzero(choice.kept)[model] - len(STATE)]
    jacobian = choice.values_jacobian[:, np.flatnonzero(choice.kept)[model] - len(STATE)]
    change, parts = jacobian @ vector[model], [parameters.leaves[k].part or parameters.leaves[k].name for k in columns]
    own = square[model] / square.sum()
    sizes, others = {}, []
    for part in dict.fromkeys(parts):
        inside = np.array([each == part for each in parts])
        share = float(own[inside].sum())
        scale = _scale(found, part, change)
        if scale is not None:
            sizes[part] = (share, scale)
        elif share >= NAMED:
            others.append((share, _members(found, vector[model], columns, inside)))
    largest = max((abs(scale) for share, scale in sizes.values() if share >= NAMED), default=0.0)
    # What is hardly moved in its own prior sigmas may yet scale as much as the others.
    scaled = {
        part: scale for part, (share, scale) in sizes.items() if share >= NAMED or 2.0 * abs(scale) > largest > 0.0
    }
    return _joined(scaled, [text for _, text in sorted(others, reverse=True)])


def _scale(found: Known, part: str, change: np.ndarray) -> float | None:
    """Relative change of a part [leaves, SI] of several numbers that keeps their proportions; None for any other."""
    choice, leaves = found.choice, found.choice.parameters.leaves
    own = [k for k, leaf in enumerate(leaves) if (leaf.part or leaf.name) == part and not leaf.restates]
    value, moved = choice.values[own], change[own]
    length = float(np.linalg.norm(value) * np.linalg.norm(moved))
    if len(own) < 2 or length == 0.0 or abs(value @ moved) < PARALLEL * length:
        return None
    return float(value @ moved / (value @ value))


def _members(found: Known, vector: np.ndarray, columns: np.ndarray, inside: np.ndarray) -> str:
    """The numbers of a part that move most, with their signs."""
    size = np.abs(vector[inside])
    named = [(k, x) for k, x, big in zip(columns[inside], vector[inside], size > 0.5 * size.max(), strict=True) if big]
    leaves = found.choice.parameters.leaves
    return " ".join(f"{'-' if x < 0.0 else '+'} {leaves[k].name}" for k, x in named)


def _joined(scaled: dict[str, float], others: Sequence[str]) -> str:
    """Scales of like size first, then the rest."""
    texts, left = [], dict(scaled)
    while left:
        name, size = max(left.items(), key=lambda item: abs(item[1]))
        alike = [each for each, other in left.items() if abs(other - size) <= TOGETHER * abs(size)]
        against = [each for each, other in left.items() if abs(other + size) <= TOGETHER * abs(size)]
        word = "scale together" if len(alike) > 1 else "scales"
        texts.append(f"{_listed(alike)} {word}" + (f" against {_listed(against)}" if against else ""))
        left = {each: other for each, other in left.items() if each not in (*alike, *against, name)}
    rest = " ".join(others).removeprefix("+ ")
    return "; ".join([*texts, *([rest] if rest else [])])


def _listed(names: Sequence[str]) -> str:
    return " and ".join(", ".join(names).rsplit(", ", 1))


def _components(found: Known, vector: np.ndarray) -> dict[str, float]:
    choice, parameters = found.choice, found.choice.parameters
    named = []
    for n in np.flatnonzero(found.prior > 0.0):
        column = np.flatnonzero(choice.kept)[n] - len(STATE)
        leaf = parameters.leaves[parameters.columns[column]]
        named.append((abs(vector[n]), leaf.name, float(vector[n] * parameters.sigma()[column] * leaf.to_unit)))
    largest = max(size for size, *_ in named)
    return {name: value for size, name, value in named if size > np.sqrt(NAMED) * largest}
