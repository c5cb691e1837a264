"""What a user may give of orbit, Earth and Sun in place of what is found from the session itself.

Where the default is None, the value is found from the session (Penkov et al. 2009, section 2.3: what `Start` writes
into `globP`); names of that module's parameters stand in the descriptions.
"""

import math
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.errors import InputError
from jaxsat.setting_types import Angle, Positive, Section, Vector

_LONGEST_S = 1e9
"""Thirty years."""


def _unit(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if abs(math.hypot(*vector) - 1.0) > 1e-3:
        raise ValueError(f"expected a unit vector, its length is {math.hypot(*vector):.6g}")
    return vector


class Orbit(Section):
    """Kepler elements in the inertial equatorial frame; all or none: left out, they are fitted to the positions."""

    inclination_deg: float | None = Field(
        default=None, ge=0, le=180, description="inclination, i [deg]", examples=[95.438873]
    )
    raan_deg: Angle | None = Field(
        default=None, description="right ascension of the ascending node, lorb [deg]", examples=[64.81879]
    )
    argument_of_perigee_deg: Angle | None = Field(
        default=None, description="argument of perigee, Uper [deg]", examples=[16.675906]
    )
    eccentricity: float | None = Field(
        default=None, ge=0, le=0.95, description="eccentricity, e [1]", examples=[0.072661]
    )
    semi_major_axis_km: float | None = Field(
        default=None, gt=6000, lt=1e6, description="semi-major axis, a [km]", examples=[7630.026457]
    )
    time_of_perigee_s: float | None = Field(
        default=None,
        ge=-_LONGEST_S,
        le=_LONGEST_S,
        description="time of perigee passage after t = 0, tper [s]",
        examples=[3230.533197],
    )
    argument_of_latitude_deg: Angle | None = Field(
        default=None,
        description="angle from the node to the satellite at t = 0, U00 [deg]; in place of time_of_perigee_s",
        examples=[-159.2832],
    )

    @model_validator(mode="after")
    def _complete(self):
        places = (self.time_of_perigee_s, self.argument_of_latitude_deg)
        shape = (
            self.inclination_deg,
            self.raan_deg,
            self.argument_of_perigee_deg,
            self.eccentricity,
            self.semi_major_axis_km,
        )
        given = [value is not None for value in shape]
        if None not in places:
            raise ValueError("time_of_perigee_s and argument_of_latitude_deg say the same: give one of them")
        if any((*given, *(place is not None for place in places))) and not (all(given) and places != (None, None)):
            raise ValueError(
                "elements are incomplete: give the five of size, shape and direction and one of time_of_perigee_s, "
                "argument_of_latitude_deg, or none of them"
            )
        return self

    def elements(self, mu: float) -> dict[str, float] | None:
        """Semi-major axis [m], eccentricity, inclination, raan, argument_of_perigee, mean_anomaly at t = 0 [rad].

        None where they are to be fitted. The keys are the leaves of `KeplerOrbit`.
        """
        if self.semi_major_axis_km is None or self.eccentricity is None:
            return None
        a, e = self.semi_major_axis_km * 1e3, self.eccentricity
        perigee = math.radians(self.argument_of_perigee_deg or 0.0)
        if self.time_of_perigee_s is not None:
            mean = -math.sqrt(mu / a**3) * self.time_of_perigee_s
        else:
            half = 0.5 * (math.radians(self.argument_of_latitude_deg or 0.0) - perigee)
            ecc_anomaly = 2.0 * math.atan2(math.sqrt(1 - e) * math.sin(half), math.sqrt(1 + e) * math.cos(half))
            mean = ecc_anomaly - e * math.sin(ecc_anomaly)
        return {
            "semi_major_axis": a,
            "eccentricity": e,
            "inclination": math.radians(self.inclination_deg or 0.0),
            "raan": math.radians(self.raan_deg or 0.0),
            "argument_of_perigee": perigee,
            "mean_anomaly": mean,
        }


class Time(Section):
    """Time scale of the session."""

    zero_s: float = Field(
        default=0.0,
        ge=-_LONGEST_S,
        le=_LONGEST_S,
        description="start of the new time scale after the earliest good sample, t00 [s]",
    )


class Earth(Section):
    """The Earth's figure and rotation."""

    radius_km: Positive = Field(default=6371.2, le=1e6, description="radius for shadow and albedo, Rzem [km]")
    rotation_rate_rad_s: float = Field(
        default=EARTH_ROTATION_RATE, ge=-1.0, le=1.0, description="rotation rate, Omz [rad/s]"
    )
    greenwich_angle_deg: Angle | None = Field(
        default=None, description="right ascension of Greenwich at t = 0, lgr00 [deg]", examples=[191.28]
    )
    greenwich_angle_at_perigee_deg: Angle | None = Field(
        default=None,
        description="the same at perigee, lgrper [deg]; in place of greenwich_angle_deg",
        examples=[204.78],
    )

    @model_validator(mode="after")
    def _one_angle(self):
        if None not in (self.greenwich_angle_deg, self.greenwich_angle_at_perigee_deg):
            raise ValueError("greenwich_angle_deg and greenwich_angle_at_perigee_deg say the same: give one of them")
        return self

    def greenwich_angle(self, time_of_perigee_s: float | None) -> float | None:
        """Right ascension of Greenwich at t = 0 [rad]; None where it follows from the epoch.

        Raises `InputError` where it is given at a perigee of which the time is not known.
        """
        if self.greenwich_angle_at_perigee_deg is not None:
            if time_of_perigee_s is None:
                reason = (
                    "the orbit is no ellipse that tells the time of its perigee: give greenwich_angle_deg, at t = 0"
                )
                raise InputError(reason, field="earth.greenwich_angle_at_perigee_deg")
            return math.radians(self.greenwich_angle_at_perigee_deg) - self.rotation_rate_rad_s * time_of_perigee_s
        return None if self.greenwich_angle_deg is None else math.radians(self.greenwich_angle_deg)


class Sun(Section):
    """Direction to the Sun."""

    direction_eci: Annotated[Vector, AfterValidator(_unit)] | None = Field(
        default=None,
        description="unit vector to the Sun, inertial axes, held fixed, SX0 SY0 SZ0 [1]",
        examples=[[0.47176670, -0.80932067, -0.34990890]],
    )


class Given(Section):
    """All of it; by default everything is found."""

    orbit: Orbit = Orbit()
    time: Time = Time()
    earth: Earth = Earth()
    sun: Sun = Sun()
