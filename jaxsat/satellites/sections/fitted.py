"""A number of a satellite file, or several at once: plain, or with a prior, bounds, and whether a fit may change it."""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, model_validator

from jaxsat.files.units import parsed_unit
from jaxsat.setting_types import Interval, Section

NAMED_AXES = {"+x": (1.0, 0, 0), "-x": (-1.0, 0, 0), "+y": (0, 1.0, 0), "-y": (0, -1.0, 0), "+z": (0, 0, 1.0)} | {
    "-z": (0.0, 0, -1.0)
}
"""Directions by name, body axes."""


def _numbers(found: Any) -> Any:
    """A number or nested tuples of numbers; ValueError for anything else."""
    if isinstance(found, bool) or not isinstance(found, int | float | list | tuple):
        raise ValueError("expected a number or a list of numbers")
    if isinstance(found, int | float):
        if not np.isfinite(found):
            raise ValueError("expected a finite number")
        return float(found)
    if not found:
        raise ValueError("expected numbers, found an empty list")
    numbers = tuple(_numbers(each) for each in found)
    if len({np.shape(each) for each in numbers}) > 1:
        raise ValueError("expected rows of equal length")
    return numbers


def _positive(found: Any) -> Any:
    if found is not None and not np.all(np.asarray(found) > 0.0):
        raise ValueError("expected a 1-sigma above zero")
    return found


class Fitted(Section):
    """Value with its prior: a number stands for {value = number}."""

    value: Annotated[Any, BeforeValidator(_numbers)]
    sigma: Annotated[
        Any, BeforeValidator(lambda found: None if found is None else _numbers(found)), AfterValidator(_positive)
    ] = None
    """1-sigma of the prior, one for all or one each."""
    free: bool | None = None
    """Whether a fit changes it by default; left out: where there is a sigma."""
    bounds: Interval | None = None

    @model_validator(mode="before")
    @classmethod
    def _plain(cls, found: Any) -> Any:
        return found if isinstance(found, dict) else {"value": found}

    @model_validator(mode="after")
    def _agrees(self):
        values = np.asarray(self.value)
        if self.sigma is not None and np.ndim(self.sigma) and np.shape(self.sigma) != values.shape:
            raise ValueError(
                f"sigma has the shape {np.shape(self.sigma)}, the value {values.shape}: give one or as many"
            )
        if self.bounds is not None and not np.all((self.bounds[0] <= values) & (values <= self.bounds[1])):
            raise ValueError(f"the value lies outside its bounds, {self.bounds[0]:g} to {self.bounds[1]:g}")
        return self

    def filled(self, *shape: int) -> np.ndarray:
        """The values as an array of this shape."""
        return np.broadcast_to(np.asarray(self.value, float), shape).copy()

    def sigmas(self, *shape: int) -> np.ndarray | None:
        """The 1-sigmas in this shape, None where there are none."""
        return None if self.sigma is None else np.broadcast_to(np.asarray(self.sigma, float), shape)


def _shaped(*shapes: tuple[int, ...], name: str) -> Callable[[Fitted], Fitted]:
    def check(found: Fitted) -> Fitted:
        if np.shape(found.value) not in shapes:
            raise ValueError(f"expected {name}")
        return found

    return check


def _above(low: float) -> Callable[[Fitted], Fitted]:
    def check(found: Fitted) -> Fitted:
        if not np.all(np.asarray(found.value) > low):
            raise ValueError(f"expected values above {low:g}")
        return found

    return check


Scalar = Annotated[Fitted, AfterValidator(_shaped((), name="a number"))]
PositiveScalar = Annotated[Scalar, AfterValidator(_above(0.0))]
Triple = Annotated[Fitted, AfterValidator(_shaped((3,), name="three numbers"))]
PositiveTriple = Annotated[
    Fitted, AfterValidator(_shaped((), (3,), name="a number or three")), AfterValidator(_above(0.0))
]
Tensor = Annotated[Fitted, AfterValidator(_shaped((3,), (3, 3), name="three principal moments or 3 x 3 numbers"))]


def plain(value: float | tuple[float, ...]) -> Fitted:
    """A value without a prior, as a default."""
    return Fitted(value=value)


def to_direction(found: Any) -> Any:
    """A unit vector of a name such as +x or of three numbers."""
    if isinstance(found, str):
        if found.lower() not in NAMED_AXES:
            raise ValueError(f"expected one of {', '.join(NAMED_AXES)} or three numbers")
        return tuple(map(float, NAMED_AXES[found.lower()]))
    vector = np.asarray(_numbers(found))
    if vector.shape != (3,) or not np.linalg.norm(vector) > 0.0:
        raise ValueError(f"expected one of {', '.join(NAMED_AXES)} or three numbers, not all zero")
    return tuple((vector / np.linalg.norm(vector)).tolist())


Direction = Annotated[Any, BeforeValidator(to_direction)]
"""A direction in body axes; its length is made one."""


def panel_names(normals: tuple[tuple[float, ...], ...]) -> list[str]:
    """Names of faces by their normals: the axis where it is one, for the first that has it; else the number from 0."""
    by_axis = {axis: name for name, axis in NAMED_AXES.items()}
    names: list[str] = []
    for number, normal in enumerate(normals):
        name = by_axis.get(tuple(normal), str(number))
        names.append(str(number) if name in names else name)
    return names


def _unit_text(text: str) -> str:
    parsed_unit(text)
    return text


UnitText = Annotated[str, AfterValidator(_unit_text)]
