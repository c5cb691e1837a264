"""Numbers of a satellite file that differ from case to case, drawn by the sigmas that stand there."""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from jaxsat.satellites import Satellite
from jaxsat.satellites.model import INERTIA_PLACE, Leaf, Model, array_at, nominal_values
from jaxsat.sweep.inputs import Input

FACTORS = (1.0, 0.5, 0.25, 0.125, 0.0)
"""Deviations of an inertia that is no body's are taken by the first of these that makes it one."""


@dataclass(frozen=True)
class Spread:
    """What is drawn: numbers of the file with their 1-sigmas."""

    leaves: tuple[Leaf, ...]
    nominal: Float[np.ndarray, " leaves"]
    sigma: Float[np.ndarray, " leaves"]
    """Times the option `spread`, SI."""

    def inputs(self) -> tuple[Input, ...]:
        """One for each part of the satellite: the values are the columns of what `drawn_model` gives, SI."""
        groups: dict[str, list[int]] = {}
        for number, leaf in enumerate(self.leaves):
            groups.setdefault(_group(leaf.name)[0], []).append(number)
        return tuple(self._input(name, numbers) for name, numbers in groups.items())

    def _input(self, name: str, numbers: list[int]) -> Input:
        first = self.leaves[numbers[0]]
        parts = tuple(_group(self.leaves[number].name)[1] for number in numbers)
        to_unit = np.array([self.leaves[number].to_unit for number in numbers])
        single = parts == ("",)

        def of(drawn):
            found = np.asarray(drawn.numbers)[:, numbers] * to_unit
            return found[:, 0] if single else found

        meaning = f"{name.replace('_', ' ')} of the satellite file"
        return Input(name, first.unit, meaning, of, () if single else parts)


def _group(name: str) -> tuple[str, str]:
    base, _, last = name.rpartition(".")
    if base and len(last) <= 2:
        return base.replace(".", "_"), last
    return name.replace(".", "_"), ""


def spread_of(satellite: Satellite, sensors: Sequence[str], spread: float) -> Spread:
    """Numbers with a sigma of the satellite itself and of the `sensors` that are used; none where `spread` is zero."""
    used = ("spacecraft.", *(f"sensors.{name}." for name in sensors))
    leaves = tuple(
        leaf
        for leaf in satellite.leaves
        if spread > 0.0 and leaf.sigma is not None and not leaf.restates and leaf.place.startswith(used)
    )
    nominal = nominal_values(satellite.model, [leaf.spot for leaf in leaves])
    return Spread(leaves, nominal, spread * np.array([leaf.sigma for leaf in leaves], float))


def drawn_model(spread: Spread, model: Model, keys: Key[Array, " cases"]) -> tuple[Model, Float[Array, "cases leaves"]]:
    """The model with the arrays that differ from case to case over the cases, and the numbers themselves, SI.

    Normal about the nominal value and within the bounds of the file.
    """
    count = len(spread.leaves)
    lower, upper = (np.array([getattr(leaf, end) for leaf in spread.leaves], float) for end in ("lower", "upper"))

    def drawn(key):
        return jnp.clip(spread.nominal + spread.sigma * jax.random.normal(key, (count,)), lower, upper)

    numbers = jax.vmap(drawn)(keys)
    places = list(dict.fromkeys(leaf.place for leaf in spread.leaves))
    arrays = []
    for place in places:
        found = array_at(model, place)
        flat = jnp.broadcast_to(jnp.reshape(found, -1), (len(keys), np.size(found)))
        own = [number for number, leaf in enumerate(spread.leaves) if leaf.place == place]
        for number in own:
            flat = flat.at[:, np.array(spread.leaves[number].entries)].set(numbers[:, number, None])
        array = flat.reshape(len(keys), *np.shape(found))
        if place == INERTIA_PLACE:
            array = jax.vmap(lambda tensor, found=found: _of_a_body(jnp.asarray(found), tensor))(array)
            entries = np.array([spread.leaves[number].entries[0] for number in own])
            numbers = numbers.at[:, np.array(own)].set(array.reshape(len(keys), -1)[:, entries])
        arrays.append(array)
    if not places:
        return model, numbers
    return eqx.tree_at(lambda m: [array_at(m, place) for place in places], model, arrays), numbers


def _of_a_body(nominal: Float[Array, "3 3"], drawn: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """The drawn tensor, or one nearer to the nominal whose moments a body can have: two of them more than the third."""
    nearer = [nominal + factor * (drawn - nominal) for factor in FACTORS]
    found = nominal
    for tensor in reversed(nearer):
        low, middle, high = jnp.linalg.eigvalsh(tensor)
        found = jnp.where((low > 0.0) & (low + middle >= high), tensor, found)
    return found
