"""What `jaxsat simulate` needs beside the satellite, the orbit and the Earth of the other sections.

The settings of the program `Orfs` (Penkov et al. 2009, sections 3.8 and 4).
"""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from jaxsat.errors import InputError
from jaxsat.physical import is_attitude, unit_quaternion
from jaxsat.setting_types import Interval, NonNegative, Positive, Section, Vector
from jaxsat.telemetry.elements.tle_lines import check_tle_lines
from jaxsat.time import Epoch

MOST_SAMPLES = 90_000
"""What a RAW_SUN file has room for."""


def _instant(text: str) -> str:
    Epoch.from_iso(text)
    return text


def _attitude(q: tuple[float, ...]) -> tuple[float, ...]:
    if not is_attitude(np.array(q)):
        raise ValueError("expected a quaternion that is not zero")
    return tuple(unit_quaternion(np.array(q)).tolist())


def _element_set(lines: tuple[str, str]) -> tuple[str, str]:
    try:
        check_tle_lines(lines)
    except InputError as error:
        raise ValueError(f"{error.field} {error.reason}") from None
    return lines


def _printable(name: str) -> str:
    if not name.strip() or not name.isascii() or not name.isprintable():
        raise ValueError("expected one line of plain text")
    return name


UnitQuaternion = Annotated[tuple[float, float, float, float], Field(strict=False), AfterValidator(_attitude)]
"""Scalar first; of any length above zero, and brought to one."""
_Outline = Annotated[tuple[Vector, ...], Field(strict=False, min_length=3, max_length=64)]


class SimulationSettings(Section):
    """A session made by `jaxsat simulate`; orbit, spacecraft, albedo, Earth and Sun are those of their sections."""

    satellite: Annotated[str, Field(max_length=60), AfterValidator(_printable)] = Field(
        default="SYNTHETIC", description="name in the first line of the session file"
    )
    epoch_utc: Annotated[str, AfterValidator(_instant)] = Field(
        default="2001-01-18T04:54:15.000", description="instant of t = 0, to which the elements of [orbit] belong"
    )
    tle: Annotated[tuple[str, str], Field(strict=False), AfterValidator(_element_set)] | None = Field(
        default=None,
        description="two-line element set: flown by SGP4 where [orbit] is left out, and written into the file; "
        "without either the orbit is Munin's on 2001-01-18",
        examples=[
            [
                "1 26621U 00075C   01018.00000000  .00001000  00000-0  10000-3 0  9994",
                "2 26621  95.4389  64.8188 0726610  16.6759 100.0000 13.02600000  8009",
            ]
        ],
    )
    duration_s: Positive = Field(default=4500.0, le=30 * 86400.0, description="length of the session [s]")
    sampling_s: Annotated[float, Field(ge=0.01)] = Field(default=64.0, description="time between samples [s]")
    quaternion: UnitQuaternion | None = Field(
        default=None,
        description="attitude at t = 0, scalar first, body to inertial axes [1]; in place of sun_magnetic_deg",
        examples=[[0.4086964, 0.1111795, -0.6106432, -0.6691197]],
    )
    sun_magnetic_deg: Vector = Field(
        default=(12.0, 0.0, 0.0),
        description="attitude at t = 0 by Sun-magnetic angles: deviation of body x from the field, azimuth of the "
        "deviation about the field from the Sun's side, roll about body x [deg]",
    )
    rate_deg_s: Vector = Field(
        default=(0.597, 0.0, 0.0),
        description="angular velocity at t = 0, body axes [deg/s]; by default a spin of 11 orbital rates",
    )
    tolerance_rad: float = Field(
        default=1e-8, ge=1e-11, le=1e-3, description="largest error of the integrated attitude [rad]"
    )
    noise: Literal["normal", "uniform"] = Field(
        default="normal", description="distribution of the noise of a current; uniform has the same sigma"
    )
    noise_mA: NonNegative = Field(default=2.0, le=1e4, description="1-sigma of it, on panels that see light [mA]")
    zero_offset_mA: float = Field(default=0.0, ge=-1e4, le=1e4, description="shift of the zero of all currents [mA]")
    quantum_mA: NonNegative = Field(
        default=1.0, le=100.0, description="step in which currents are telemetered [mA]; 0 writes 0.001 mA"
    )
    limit_s: Interval | None = Field(
        default=None,
        description="interval [t0, t1] in which the charge current is limited [s]",
        examples=[[2000.0, 2500.0]],
    )
    limit_factors: Annotated[tuple[NonNegative, NonNegative, NonNegative], Field(strict=False)] = Field(
        default=(1.0, 1.0, 1.0), description="factors of the panels on x, y, z then, lx ly lz [1]"
    )
    limit_panel_mA: Positive | None = Field(
        default=None, description="largest current of a panel then [mA]", examples=[180.0]
    )
    limit_sum_mA: Positive | None = Field(
        default=None,
        description="largest sum of the six currents then, all lowered alike [mA]",
        examples=[300.0],
    )
    position_sigma_km: NonNegative = Field(
        default=0.3, le=1e3, description="1-sigma of each coordinate as telemetered [km]"
    )
    velocity_sigma_m_s: NonNegative = Field(default=0.3, le=1e3, description="1-sigma of each velocity [m/s]")
    magnetometer_sigma_uT: NonNegative = Field(
        default=0.3, le=100.0, description="1-sigma of a magnetometer reading [uT]"
    )
    panel_corners_m: Annotated[tuple[_Outline, ...], Field(strict=False, min_length=1, max_length=64)] | None = Field(
        default=None,
        description="further flat convex panels, each by its corners in body axes, counter-clockwise seen from the "
        "working side [m]; their direct and mirrored currents go to panels.csv",
        examples=[[[[0.1, 0.0, 0.0], [0.1, 0.2, 0.0], [0.1, 0.0, 0.2]]]],
    )
    panel_density_mA_m2: Positive = Field(
        default=6000.0, description="their current in direct sunlight at right angles [mA/m^2]"
    )
    seed: int = Field(default=0, ge=0, lt=2**32, description="seed of all noise")

    @model_validator(mode="after")
    def _samples(self):
        count = self.duration_s / self.sampling_s
        if not 3.0 <= count < MOST_SAMPLES:
            raise ValueError(f"duration_s over sampling_s gives {count:.6g} samples, expected 3 to {MOST_SAMPLES}")
        return self

    @model_validator(mode="after")
    def _limits(self):
        limits = self.limit_factors != (1.0, 1.0, 1.0) or self.limit_panel_mA or self.limit_sum_mA
        if limits and self.limit_s is None:
            raise ValueError("limit_factors, limit_panel_mA and limit_sum_mA act within limit_s, which is not given")
        return self
