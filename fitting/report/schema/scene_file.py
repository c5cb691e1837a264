"""The file scene.json."""

from typing import Annotated

from pydantic import Field

from fitting.report.schema.kinds import Seconds, Span, Stored, Triple


class Globe(Stored):
    """The Earth of a scene."""

    radius_km: float = Field(gt=0.0)
    greenwich_angle_rad: float
    rotation_rate_rad_s: float


class Ellipse(Stored):
    """Once round the orbit."""

    period_s: float = Field(gt=0.0)
    position_km: list[Triple] = Field(min_length=2)
    lit: list[int]


class Track(Stored):
    """Along the arc."""

    position_km: list[Triple] = Field(min_length=2)
    velocity_km_s: list[Triple]
    field_uT: list[Triple]


class Motion(Stored):
    """Nodes of the attitude."""

    t_s: list[Seconds] = Field(min_length=2)
    quaternion_inertial_from_body: list[Annotated[list[float], Field(min_length=4, max_length=4)]]


class Scene(Stored):
    """The file scene.json."""

    begin_s: Seconds
    end_s: Seconds
    earth: Globe
    sun_eci: list[Triple] = Field(min_length=1)
    shadow_s: list[Span]
    orbit: Ellipse
    track: Track
    field_lines_km: list[list[int]] | None
    attitude: Motion
