"""The kinds of value that sections of a configuration are made of, each with its limits."""

from typing import Annotated, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Kind = TypeVar("Kind", bound="Section")


class Section(BaseModel):
    """A table of the file: no key but its own, no number that is not finite, nothing converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    def changed(self: Kind, **values: object) -> Kind:
        """The same with other values, checked as any; raises ValueError (pydantic's) naming what cannot be."""
        return type(self).model_validate({**dict(self), **values})


def _increasing(interval: tuple[float, float]) -> tuple[float, float]:
    if not interval[0] < interval[1]:
        raise ValueError("expected [t0, t1] with t0 < t1")
    return interval


# TOML has lists only; strict=False lets a list be a tuple, the numbers within stay strict.
Pair = Annotated[tuple[float, float], Field(strict=False)]
Vector = Annotated[tuple[float, float, float], Field(strict=False)]
Tilt = Annotated[
    tuple[Annotated[float, Field(ge=-45.0, le=45.0)], Annotated[float, Field(ge=-45.0, le=45.0)]], Field(strict=False)
]
Interval = Annotated[Pair, AfterValidator(_increasing)]
Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
