"""What a satellite file says of the telemetry: stamps, rows, channels; and of the orbit and the motion."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from jaxsat.files.conditions import parsed_condition
from jaxsat.satellites.sections.fitted import Scalar, UnitText, plain
from jaxsat.setting_types import Angle, Positive, Section
from jaxsat.time import Epoch

Names = Annotated[tuple[str, ...], Field(strict=False, min_length=1)]


def _instant(text: str) -> str:
    Epoch.from_iso(text)
    return text


Instant = Annotated[str, AfterValidator(_instant)]
"""UTC, as 2020-11-21T20:58:01Z."""


def _condition(text: str) -> str:
    parsed_condition(text)
    return text


class TimeSettings(Section):
    """Stamps of the table."""

    column: str
    """Of the stamps."""
    form: Literal["iso", "unix", "seconds"] = "iso"
    """iso: as 2020-11-21T20:58:01Z; unix: since 1970; seconds: since `epoch`."""
    epoch: Instant | None = None
    """Of the form `seconds`."""
    unit: Literal["s", "ms", "us", "ns"] = "s"
    """Of the forms `unix` and `seconds`."""
    zone: str | None = Field(default=None, pattern=r"UTC|[+-][0-9]{2}:[0-9]{2}")
    """Of ISO stamps that name none: UTC or +02:00; without it they are refused, for nobody knows whose clock it was."""
    offset_s: float = 0.0
    """Stamps minus UTC: 18.0 for GPS time."""
    resolution_s: Positive | None = None
    """To which stamps are rounded."""

    @model_validator(mode="after")
    def _zero(self):
        if (self.form == "seconds") != (self.epoch is not None):
            raise ValueError('epoch is needed by form = "seconds" and by no other')
        return self


class RowSettings(Section):
    """Which rows count."""

    keep: Annotated[tuple[Annotated[str, AfterValidator(_condition)], ...], Field(strict=False)] = ()
    """Conditions such as "mode == 0" or "abs(bx) < 60000", all of which a row must meet; what is not measured meets."""
    not_measured: Annotated[tuple[str, ...], Field(strict=False)] = ()
    """Texts beside the empty one that mean so, as "nan" or "N/A"."""


class ChannelSettings(Section):
    """Columns of one sensor."""

    columns: Names
    """One for each number of the reading; "" for one that is not telemetered."""
    unit: UnitText
    sigma: Positive | None = None
    """1-sigma of the noise of a number, without rounding [unit]."""
    quantum: Positive | None = None
    """Step of the digits [unit]."""
    delay_s: Scalar = plain(0.0)
    """Stamp minus instant of measurement."""
    interval_s: Positive | None = None
    """Between readings that `jaxsat simulate` makes; left out: as its option says."""
    loss: Literal["normal", "student", "mixture"] | None = None
    """What may be wrong with a sample: normal (nothing), student (heavy tails), mixture (anything);
    left out: as the fit has it for all channels."""
    zero_is_floor: bool = True
    """Of panels with a quantum: whether a current of zero was half a step or less, for there is nothing below it."""
    role: Literal["fitted", "witness"] = "fitted"
    """A witness is not fitted: it is asked afterwards whether it agrees."""

    @model_validator(mode="after")
    def _noise(self):
        if self.sigma is None and self.quantum is None:
            raise ValueError("give sigma, or quantum where rounding is all the noise")
        if not any(self.columns):
            raise ValueError("expected at least one column")
        return self


class Elements(Section):
    """Kepler elements, true equator and equinox of date."""

    a_km: float = Field(gt=6000.0, lt=1e6)
    e: float = Field(ge=0.0, le=0.95)
    i_deg: float = Field(ge=0.0, le=180.0)
    raan_deg: Angle
    argp_deg: Angle
    mean_anomaly_deg: Angle
    epoch: Instant


class PositionColumns(Section):
    """Positions in the table."""

    position: Annotated[tuple[str, str, str], Field(strict=False)]
    velocity: Annotated[tuple[str, str, str], Field(strict=False)] | None = None
    """Of the same axes, `unit` a second."""
    unit: Literal["m", "km"] = "km"
    frame: Literal["eci", "gcrf", "ecef"]
    """eci: true equator and equinox of date; gcrf: also J2000; ecef: turning with the Earth."""
    law: Literal["spline", "kepler"] = "spline"
    """spline: through the positions; kepler: the ellipse that fits them best, where they are few or rough."""

    @model_validator(mode="after")
    def _of_an_ellipse(self):
        if (self.law == "kepler") != (self.velocity is not None):
            raise ValueError('velocity (three columns) belongs to law = "kepler"')
        if self.law == "kepler" and self.frame != "eci":
            raise ValueError('law = "kepler" needs positions and velocities in the frame "eci"')
        return self


def _lines(found: Any) -> Any:
    if isinstance(found, str) or (isinstance(found, list | tuple) and len(found) == 2 and all(map(_is_text, found))):
        return found if isinstance(found, str) else tuple(found)
    raise ValueError("expected the name of a file or the two lines of an element set")


def _is_text(found: Any) -> bool:
    return isinstance(found, str)


class OrbitSettings(Section):
    """Where the satellite is: one of these. Files are looked for beside the satellite file."""

    tle: Annotated[Any, BeforeValidator(_lines)] = None
    """A file, or the two lines; of several element sets the nearest is taken."""
    omm: str | None = None
    """A file of CCSDS orbit mean elements."""
    oem: str | None = None
    """A file of CCSDS orbit ephemerides."""
    elements: Elements | None = None
    columns: PositionColumns | None = None

    @model_validator(mode="after")
    def _one(self):
        given = [name for name in type(self).model_fields if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"expected one of tle, omm, oem, elements, columns, found {' and '.join(given) or 'none'}")
        return self


class GaugeSettings(Section):
    """What no channel can tell, and is therefore held by definition."""

    hold: Annotated[tuple[str, ...], Field(strict=False)] = ()
    """"magnet": its modulus, where all of inertia and magnet is fitted, for without torques of known size only the
    ratios of inertia, magnet and rods turn the satellite. "NAME.gain" of a sensor NAME of panels: the mean of its
    gains, where they and imax are fitted."""


class MotionSettings(Section):
    """How the satellite turns: by its torques, as columns tell, or fixed to the orbital frame."""

    kind: Literal["free", "given", "orbital"] = "free"
    columns: Annotated[tuple[str, str, str, str], Field(strict=False)] | None = None
    """Quaternion."""
    sense: Literal["body_from_inertial", "inertial_from_body"] | None = None
    scalar: Literal["first", "last"] = "first"
    frame: Literal["eci", "gcrf"] = "eci"
    """Inertial axes of the quaternion: true equator and equinox of date, or the GCRF (also J2000)."""

    @model_validator(mode="after")
    def _given(self):
        needed = (self.columns, self.sense)
        if self.kind == "given" and None in needed:
            raise ValueError('kind = "given" needs columns (four) and sense')
        if self.kind != "given" and needed != (None, None):
            raise ValueError('columns and sense belong to kind = "given"')
        return self
