"""The kinds of value that stored files are made of."""

from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from jaxsat.files.text_file import hidden_character
from jaxsat.time import Epoch


def _instant(text: str) -> str:
    Epoch.from_iso(text)
    return text


def _seen(text: str) -> str:
    if hidden := hidden_character(text):
        raise ValueError(f"{hidden} has no place in a name")
    return text


Maybe = float | None
Count = Annotated[int, Field(ge=0)]
Instant = Annotated[str, AfterValidator(_instant)]
Seconds = Annotated[float, Field(ge=-1e10, le=1e10)]
Words = Annotated[str, Field(min_length=1)]
Name = Annotated[str, Field(min_length=1), AfterValidator(_seen)]
Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
MaybeTriple = Annotated[list[Maybe], Field(min_length=3, max_length=3)]
Rotation = Annotated[list[Maybe], Field(min_length=4, max_length=4)]
Span = Annotated[list[Seconds], Field(min_length=2, max_length=2)]


class Stored(BaseModel):
    """Values as they stand: nothing is converted, no number is beyond what can be told."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False, frozen=True)


class Value(Stored):
    """A number with its 1-sigma."""

    value: float
    sigma: Maybe
    unit: str
