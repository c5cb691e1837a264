"""The file fit.json; keys that are not read back are not looked at."""

from typing import Annotated, Any, Literal

from pydantic import Field

from fitting.report.schema.kinds import (
    Count,
    Instant,
    Maybe,
    MaybeTriple,
    Moderate,
    Name,
    Rotation,
    Seconds,
    Stored,
    Triple,
    Value,
    Words,
)


class Parameter(Value):
    """One parameter of a fit."""

    free: bool


class Rms(Stored):
    """Of a channel's residuals."""

    value: Maybe
    unit: str


class Holdout(Stored):
    """Of a channel that was held out."""

    rms: float
    promised_rms: float = Field(gt=0.0)
    angle_deg: Maybe
    count: Count
    outliers: Count
    directions: float = Field(default=1e6, gt=0.0)


class Wish(Stored):
    """Whereto a witness would move the fit."""

    directions: int
    strength: float
    p: float
    explained: float
    believed: bool


class Witness(Stored):
    """Of a channel that was not fitted; the numbers of `Holdout` where it could be predicted."""

    confirms: bool
    says: str
    rms: float | None = None
    promised_rms: float | None = Field(default=None, gt=0.0)
    angle_deg: Maybe = None
    count: Count | None = None
    outliers: Count
    wish: Wish | None = None


class Delay(Stored):
    """Of a channel's stamps."""

    value: float
    sigma: Maybe
    origin: Literal["fit", "residuals"] = Field(alias="from")


class Change(Stored):
    """At a break."""

    t_s: Seconds
    turn_deg: float
    bias: float
    saving: float
    left: list[Maybe]


class Breaks(Stored):
    """Of a channel."""

    channel: str
    breaks: list[Change]


class Direction(Stored):
    """That the data hardly see."""

    name: str
    information: float
    held_by: str
    components: dict[str, float]


class Alternative(Stored):
    """Another motion or convention."""

    chi2_above_best: float
    attitude_distance_deg: float
    axes: dict[str, list[str]] = {}
    rate_deg_s: list[float] = []


class Cause(Stored):
    """What would explain the data of a fit that is denied."""

    kind: str
    cause: str
    meaning: str
    chi2_before: float
    chi2_after: float
    added: int
    explains: bool
    option: str


class Channel(Stored):
    """What a channel is."""

    kind: str
    role: Literal["fitted", "witness"]
    columns: list[Name] = Field(min_length=1)
    unit: str
    sigma: float = Field(gt=0.0)
    chi2_per_reading: Maybe
    angle_deg: Maybe


class Residuals(Stored):
    """Of one column of a channel."""

    count: Count
    rms: Maybe
    rms_z: Maybe
    mean: Maybe
    mean_z: Maybe
    lag1: Maybe
    lag1_z: Maybe
    ljung_box_p: Maybe
    lags: int


class Columns(Stored):
    """Residuals of a channel by column."""

    columns: dict[str, Residuals]


class Diagnosed(Stored):
    """Residuals by channel."""

    channels: dict[str, Columns]


class Profiled(Stored):
    """A profile of one parameter."""

    name: str
    unit: str
    best: float
    sigma: Maybe
    values: list[float] = Field(min_length=2)
    rise: list[Maybe]
    rise_data: list[Maybe]
    settled: list[bool]
    interval_68: Annotated[list[Maybe], Field(min_length=2, max_length=2)]
    interval_95: Annotated[list[Maybe], Field(min_length=2, max_length=2)]
    note: str


class Attitude(Stored):
    """Over the times of the fit."""

    t_s: list[Seconds] = Field(min_length=1)
    quaternion_inertial_from_body: list[Rotation]
    angular_velocity_rad_s: list[MaybeTriple]
    field_angle_deg: list[Moderate | None] | None


class Orbit(Stored):
    """States at the times of the attitude."""

    object_name: Name | None = None
    object_id: Name | None = None
    elements: dict[str, Value] | None = None
    position_eci_m: list[Triple]
    velocity_eci_m_s: list[Triple]


class Exported(Stored):
    """What other programs are given of fit.json."""

    epoch_utc: Instant
    status: Literal["converged", "not_converged", "ambiguous"]
    channels: dict[str, Any]
    attitude: Attitude
    orbit: Orbit | None = None


class Fit(Stored):
    """The file fit.json."""

    telemetry: str
    epoch_utc: Instant
    status: Literal["converged", "not_converged", "ambiguous"]
    message: str
    verdict: list[Words] = Field(min_length=1)
    chi2: float
    dof: int
    residual_rms: dict[str, Rms]
    holdout: dict[str, Holdout] | None
    witness: dict[str, Witness] | None
    parameters: dict[str, Parameter]
    gauge: str | None
    unseen: list[Direction]
    buys: dict[str, float]
    correlations: dict[str, dict[str, float]]
    axes: dict[str, list[str]]
    alternatives: list[Alternative]
    causes: list[Cause] = []
    delays: dict[str, Delay]
    breaks: list[Breaks]
    channels: dict[str, Channel]
    attitude: Attitude
    orbit: Orbit | None = None
    diagnostics: Diagnosed
    profiles: dict[str, Profiled]
    timing_s: dict[str, float]
