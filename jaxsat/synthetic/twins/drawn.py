"""A satellite as it may really be: numbers drawn from the priors of its file, and axes that the file leaves open."""

import itertools
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxsat.errors import InputError
from jaxsat.physical import check_inertia
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import INERTIA_PLACE, Leaf, Model, nominal_values, with_values

ATTEMPTS = 1000
RODS = "spacecraft.hysteresis_rods."
"""Where the numbers of rods with hysteresis stand."""


def drawn_model(satellite: Satellite, random: np.random.Generator) -> Model:
    """Returns a model whose numbers with a sigma are drawn, normal within their bounds.

    What depends on each other is drawn together until some body has that inertia tensor, and some material that loop.
    Raises `InputError` naming numbers whose priors allow none.
    """
    leaves = [leaf for leaf in satellite.leaves if leaf.sigma is not None]
    values = drawn_values(satellite, leaves, random)
    model = with_values(satellite.model, [leaf.spot for leaf in leaves], jnp.asarray(values))
    for name in satellite.conventions:
        axes = _some_axes(random, mirrored=satellite.conventions[name] == "mirrored")
        model = eqx.tree_at(lambda m, name=name: m.sensors[name].axes, model, jnp.asarray(axes))  # type: ignore[misc]
    return model


def drawn_values(satellite: Satellite, leaves: Sequence[Leaf], random: np.random.Generator) -> np.ndarray:
    """Values [leaves, SI] about those of the satellite by the sigma of each leaf, normal within bounds.

    As `drawn_model` draws them, what depends on each other together. Raises `InputError` naming numbers whose sigmas
    allow none.
    """
    groups: dict[str, list[int]] = {}
    for number, leaf in enumerate(leaves):
        groups.setdefault(_group(leaf), []).append(number)
    found = np.empty(len(leaves))
    for name, numbers in groups.items():
        found[numbers] = _drawn(name, [leaves[k] for k in numbers], satellite, random)
    return found


def _group(leaf: Leaf) -> str:
    """Numbers that are drawn together: the tensor, the numbers of a rod; each other one by itself."""
    return leaf.part if leaf.place == INERTIA_PLACE or leaf.place.startswith(RODS) else leaf.name


def _drawn(name: str, leaves: Sequence[Leaf], satellite: Satellite, random: np.random.Generator) -> np.ndarray:
    nominal = nominal_values(satellite.model, [leaf.spot for leaf in leaves])
    sigma, lower, upper = (np.array([getattr(leaf, key) for leaf in leaves]) for key in ("sigma", "lower", "upper"))
    for _ in range(ATTEMPTS):
        values = nominal + sigma * random.standard_normal(len(leaves))
        if np.all((lower < values) & (values < upper)) and _possible(name, leaves, values, satellite):
            return values
    raise InputError("its prior allows next to no value within its bounds", file=satellite.path, field=name)


def _possible(name: str, leaves: Sequence[Leaf], values: np.ndarray, satellite: Satellite) -> bool:
    if leaves[0].place == INERTIA_PLACE:
        tensor = np.array(satellite.model.spacecraft.inertia)
        for leaf, value in zip(leaves, values, strict=True):
            tensor.flat[list(leaf.entries)] = value
        try:
            check_inertia(tensor)
        except ValueError:
            return False
    rod = _rod(name, leaves, values, satellite)
    return not rod or (rod["remanence"] < rod["saturation"] and abs(rod["induction"]) < 0.99 * rod["saturation"])


def _rod(name: str, leaves: Sequence[Leaf], values: np.ndarray, satellite: Satellite) -> Mapping[str, float]:
    """All numbers of a rod with hysteresis by their fields, those that are not drawn too; empty for what is none."""
    if not leaves[0].place.startswith(RODS):
        return {}
    own = [leaf for leaf in satellite.leaves if leaf.part == name and leaf.place.startswith(RODS)]
    found = nominal_values(satellite.model, [leaf.spot for leaf in own])
    by_place = {leaf.place: float(value) for leaf, value in zip(own, found, strict=True)}
    by_place |= {leaf.place: float(value) for leaf, value in zip(leaves, values, strict=True)}
    return {place.removeprefix(RODS): value for place, value in by_place.items()}


def _some_axes(random: np.random.Generator, *, mirrored: bool) -> np.ndarray:
    """One of the 24 right-handed ways to read along the body's axes, or of all 48."""
    ways = [
        np.diag(signs)[:, list(order)]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    ]
    ways = [way for way in ways if mirrored or np.linalg.det(way) > 0.0]
    return ways[random.integers(len(ways))]
