"""What a simulated session of any satellite needs beside its file."""

from collections.abc import Mapping

from pydantic import Field, ValidationError, model_validator

from jaxsat.errors import InputError
from jaxsat.satellites.sections.session import Instant
from jaxsat.setting_types import Positive, Section, Vector
from jaxsat.synthetic.settings import UnitQuaternion

MOST_SAMPLES = 200_000


class TwinSettings(Section):
    """Length and sampling of the session, the motion at its start, and what is drawn."""

    start_utc: Instant | None = None
    """Instant of t = 0; left out: the epoch of the file's stamps, else of its orbit (`epoch_of`)."""
    duration_s: Positive = Field(default=600.0, le=30 * 86400.0)
    every_s: float = Field(default=5.0, ge=0.01)
    """Between readings of channels that have no `interval_s` of their own."""
    rate_deg_s: Vector | None = None
    """Angular velocity at t = 0, body axes; left out: drawn, 1-sigma 1 deg/s about each axis."""
    quaternion: UnitQuaternion | None = None
    """Attitude at t = 0, inertial from body; left out: drawn, any."""
    seed: int = Field(default=0, ge=0, lt=2**32)
    """Of all that is drawn."""
    nominal: bool = False
    """Whether the satellite is as its file says; else its numbers are drawn from their priors."""
    tolerance_rad: float | None = Field(default=None, ge=1e-11, le=1e-2)
    """Largest error of the integrated attitude; left out: 1e-5, or 1e-4 where no step holds that."""

    @model_validator(mode="after")
    def _samples(self):
        count = self.duration_s / self.every_s
        if not 2.0 <= count < MOST_SAMPLES:
            raise ValueError(f"duration over interval gives {count:.6g} readings, expected 2 to {MOST_SAMPLES}")
        return self


def twin_settings(
    given: Mapping[str, object],
    *,
    names: Mapping[str, str] | None = None,
    several: str | None = None,
    strict: bool | None = None,
) -> TwinSettings:
    """The settings of values that were given; where not `strict` as text, too.

    Raises `InputError` with the name of the value that cannot be, by `names` where it has another there, and `several`
    where it is more than one.
    """
    try:
        return TwinSettings.model_validate(dict(given), strict=strict)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        own = str(first["loc"][0]) if first["loc"] else None
        field = several if own is None else (names or {}).get(own, own)
        raise InputError(first["msg"].removeprefix("Value error, "), field=field) from None
