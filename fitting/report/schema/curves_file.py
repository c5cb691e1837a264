"""The file curves.json."""

from typing import Annotated

from pydantic import Field

from fitting.report.schema.kinds import Moderate, Name, Seconds, Stored, Triple

Rows = list[list[Moderate | None]]
"""Of readings: a row a point."""


class Curves(Stored):
    """The file curves.json: motion and readings at the samples and between them."""

    t_s: list[Seconds] = Field(min_length=2)
    quaternion_inertial_from_body: list[Annotated[list[Moderate], Field(min_length=4, max_length=4)]]
    angular_velocity_rad_s: list[Triple]
    readings: dict[Name, Rows]
    direct: dict[Name, Rows]
