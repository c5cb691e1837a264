"""The list of what may be fitted, as it grows while a satellite file is made into a model."""

import math
from collections.abc import Sequence

from jaxtyping import Array

from jaxsat.math import put
from jaxsat.satellites.model import Leaf
from jaxsat.satellites.sections.fitted import Fitted

XYZ = (".x", ".y", ".z")


class LeafList:
    """Leaves in the order of the file."""

    def __init__(self) -> None:
        self.found: list[Leaf] = []

    def add(
        self,
        name: str,
        place: str,
        given: Fitted,
        suffixes: Sequence[str] = ("",),
        *,
        unit: str = "1",
        factor: float = 1.0,
        loose: float,
        lower: float = -math.inf,
        upper: float = math.inf,
        entries: Sequence[tuple[int, ...]] | None = None,
    ) -> None:
        """Takes up an array of the file, one leaf a suffix.

        `factor` is what one `unit` is in SI; `loose` (SI) the weak prior's sigma where the file gives none; bounds are
        SI; `entries` the places of each in the flat array, by default one after the other.
        """
        sigmas = given.sigmas(len(suffixes))
        if given.bounds is not None:
            lower, upper = max(lower, given.bounds[0] * factor), min(upper, given.bounds[1] * factor)
        for number, suffix in enumerate(suffixes):
            width = loose if sigmas is None else float(sigmas[number]) * factor
            free = sigmas is not None if given.free is None else given.free
            self.found.append(
                Leaf(
                    name=name + suffix,
                    place=place,
                    entries=(number,) if entries is None else entries[number],
                    unit=unit,
                    to_unit=1.0 / factor,
                    sigma=width if free else None,
                    loose=width,
                    lower=lower,
                    upper=upper,
                )
            )

    def add_scalar_at(self, entry: int, name: str, place: str, given: Fitted, **settings) -> None:
        """Takes up a number that is one entry of an array."""
        self.add(name, place, given, entries=[(entry,)], **settings)


def as_array(given: Fitted, *shape: int, factor: float = 1.0) -> Array:
    """The values in SI."""
    return put(given.filled(*shape) * factor)
