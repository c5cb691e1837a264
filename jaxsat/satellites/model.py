"""A satellite with its sensors as one tree of numbers, and the names under which the numbers may be fitted."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import entries_at, with_entries
from jaxsat.sensors import Albedo
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.spacecraft import Spacecraft


class Model(eqx.Module):
    """All that a session's readings follow from, beside the motion's start and the surroundings."""

    spacecraft: Spacecraft
    sensors: Mapping[str, AbstractSensor]
    """By the name of their channel."""
    albedo: Albedo
    """Reflectivity of the Earth."""
    delays: Mapping[str, Float[Array, ""]]
    """Stamp minus instant of measurement of each channel [s]."""


MAGNET_PLACE, INERTIA_PLACE = "spacecraft.magnet", "spacecraft.inertia"
POLAR_PLACE = "polar.magnet"
"""Of no array in a `Model`: the dipole said by its modulus [A m2] and two angles [rad], azimuth from body x towards y
and elevation above the xy plane. A model with other values is made by those of the vector."""

Spot = tuple[str, tuple[int, ...]]
"""Path of an array in a `Model`, and the places in the flat array that have one value."""


@dataclass(frozen=True)
class Leaf:
    """One number of a `Model` that may be fitted."""

    name: str
    """As users say it: `mag.bias.x`."""
    place: str
    """Path of its array: `sensors.mag.bias`."""
    entries: tuple[int, ...]
    """Places in the flat array that have this value: two for an entry beside a symmetric tensor's diagonal."""
    unit: str
    """In which results quote it."""
    to_unit: float = 1.0
    """From SI to that unit."""
    sigma: float | None = None
    """1-sigma of the prior about the nominal value, SI; None: not free unless asked for, and then with `loose`."""
    loose: float = 1.0
    """1-sigma of a weak prior where the file gives none, SI."""
    lower: float = -np.inf
    upper: float = np.inf
    """Bounds, SI."""
    part: str = ""
    """What it is put back with, where a result tells what is gained: `mag.bias`."""

    @property
    def spot(self) -> "Spot":
        """Where it stands, without its numbers: static in compiled programs."""
        return self.place, self.entries

    @property
    def moves(self) -> bool:
        """Whether it moves the satellite; else it only changes what a sensor reads."""
        return self.place.startswith("spacecraft.") or self.restates

    @property
    def restates(self) -> bool:
        """Whether it says in another way what other leaves say, and is free by its own name alone."""
        return self.place == POLAR_PLACE


def array_at(model: Model, place: str) -> Any:
    """The array of a model at a path such as `sensors.mag.bias` or `spacecraft.parts.0.coefficient`.

    Of any model-like tree: `tree_at` asks for places in one whose leaves are marks.
    """
    found: Any = model
    for part in place.split("."):
        if isinstance(found, Mapping):
            found = found[part]
        elif isinstance(found, tuple | list):
            found = found[int(part)]
        else:
            found = getattr(found, part)
    return found


def sensor_of(leaf: Leaf, model: Model) -> AbstractSensor | None:
    """The sensor whose number a leaf is; None for those of the satellite, the Earth and the stamps."""
    kind, _, place = leaf.place.partition(".")
    return model.sensors[place.split(".")[0]] if kind == "sensors" else None


def nominal_values(model: Model, spots: Sequence[Spot]) -> Float[np.ndarray, " spots"]:
    """Values at the spots, SI, on the host."""
    arrays = {
        place: _polar(model) if place == POLAR_PLACE else np.asarray(array_at(model, place)).reshape(-1)
        for place, _ in spots
    }
    return np.array([arrays[place][entries[0]] for place, entries in spots], dtype=float)


def _polar(model: Model) -> np.ndarray:
    """Modulus, azimuth and elevation of the dipole; azimuth 0 along z, all 0 for none."""
    x, y, z = np.asarray(array_at(model, MAGNET_PLACE), dtype=float)
    across = np.hypot(x, y)
    return np.array([np.hypot(across, z), np.arctan2(y, x) if across > 0.0 else 0.0, np.arctan2(z, across)])


def with_values(model: Model, spots: Sequence[Spot], values: Float[Array, " spots"]) -> Model:
    """The model with other values at the spots, those of `POLAR_PLACE` aside. Differentiable by the values."""
    places = list(dict.fromkeys(place for place, _ in spots if place != POLAR_PLACE))
    if not places:
        return model
    arrays = [_filled(array_at(model, place), list(_entries(spots, place)), values) for place in places]
    return eqx.tree_at(lambda m: [array_at(m, place) for place in places], model, arrays)


def _entries(spots: Sequence[Spot], place: str) -> Iterator[tuple[int, int]]:
    """Pairs of flat place and number of the spot that stands there."""
    for number, (where, entries) in enumerate(spots):
        if where == place:
            yield from ((entry, number) for entry in entries)


def _filled(array: Array, pairs: list[tuple[int, int]], values: Float[Array, " spots"]) -> Array:
    places, numbers = np.array(pairs).T
    flat = jnp.asarray(array, values.dtype).reshape(-1)
    return with_entries(flat, places, entries_at(values, numbers)).reshape(np.shape(array))
