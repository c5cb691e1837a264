"""A satellite of Munin's kind as a file describes it: inertia, magnet, two rods, six panels, and the Earth's light.

Values that nobody gives are those of Munin, in `munin.toml` beside this file.
"""

import math
import tomllib
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from jaxsat.physical import check_inertia
from jaxsat.setting_types import Angle, NonNegative, Positive, Section, Tilt, Vector

MUNIN_FILE = Path(__file__).parent / "munin.toml"
MUNIN: dict[str, Any] = tomllib.loads(MUNIN_FILE.read_text(encoding="utf-8"))
"""The sections of Munin's file."""
_CRAFT = MUNIN["spacecraft"]
_INERTIA = _CRAFT["inertia_kg_m2"]


class Inertia(Section):
    """Inertia tensor about the centre of mass, body axes; xy is the tensor's entry J(1,2) itself."""

    xx: float = Field(default=_INERTIA["xx"], description="J(1,1) [kg m2]")
    yy: float = Field(default=_INERTIA["yy"], description="J(2,2) [kg m2]")
    zz: float = Field(default=_INERTIA["zz"], description="J(3,3) [kg m2]")
    xy: float = Field(default=_INERTIA["xy"], description="J(1,2) [kg m2]")
    xz: float = Field(default=_INERTIA["xz"], description="J(1,3) [kg m2]")
    yz: float = Field(default=_INERTIA["yz"], description="J(2,3) [kg m2]")

    @model_validator(mode="after")
    def _of_a_body(self):
        check_inertia(self.tensor())
        return self

    def tensor(self) -> np.ndarray:
        """[3 3] kg m2."""
        return np.array([[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]])


class Spacecraft(Section):
    """Nominal satellite: what is not fitted keeps these values, what is starts from them."""

    magnet_A_m2: Vector | None = Field(
        default=None,
        description="magnet's dipole, body axes [A m2]; in place of the next three",
        examples=[[0.3, 0.0, 0.0]],
    )
    magnet_modulus_A_m2: NonNegative = Field(
        default=_CRAFT["magnet_modulus_A_m2"], description="magnet's dipole moment, Imag [A m2]"
    )
    magnet_azimuth_deg: Angle = Field(
        default=_CRAFT["magnet_azimuth_deg"], description="its azimuth from body x towards y, alf [deg]"
    )
    magnet_elevation_deg: float = Field(
        default=_CRAFT["magnet_elevation_deg"],
        ge=-90,
        le=90,
        description="its elevation above the body xy plane, bet [deg]",
    )
    rods_A_m2: Annotated[tuple[NonNegative, NonNegative], Field(strict=False)] = Field(
        default=tuple(_CRAFT["rods_A_m2"]),
        description="moments of the rods along body y and z in the reference field, I2 I3 [A m2]",
    )
    reference_field_T: Positive = Field(
        default=_CRAFT["reference_field_T"], description="field in which rods_A_m2 is quoted [T]"
    )
    imax_mA: Positive = Field(default=_CRAFT["imax_mA"], description="current of a panel facing the Sun, Imax [mA]")
    gains: Annotated[tuple[Positive, Positive, Positive, Positive, Positive, Positive], Field(strict=False)] = Field(
        default=tuple(_CRAFT["gains"]),
        description="current of the panels +X -X +Y -Y +Z -Z over imax_mA in equal light [1]",
    )
    panel_tilts_deg: Annotated[tuple[Tilt, ...], Field(strict=False, min_length=6, max_length=6)] = Field(
        default=((0.0, 0.0),) * 6,
        description="turns of the panels +X -X +Y -Y +Z -Z off their places, each about the two body axes across it, "
        "as tilts.+x.y, tilts.+x.z, tilts.-x.y ... name them [deg]",
    )
    inertia_kg_m2: Inertia = Field(default=Inertia(), description="inertia tensor, J")

    @model_validator(mode="after")
    def _one_magnet(self):
        polar = ("magnet_modulus_A_m2", "magnet_azimuth_deg", "magnet_elevation_deg")
        # Written out at their defaults they stand in every file made from the template, and contradict nothing.
        changed = [name for name in polar if getattr(self, name) != type(self).model_fields[name].default]
        if self.magnet_A_m2 is not None and changed:
            raise ValueError(f"magnet_A_m2 and {', '.join(changed)} say the same: give one of them")
        return self

    def magnet(self) -> np.ndarray:
        """[3] dipole, body axes [A m2]."""
        if self.magnet_A_m2 is not None:
            return np.array(self.magnet_A_m2)
        azimuth, elevation = math.radians(self.magnet_azimuth_deg), math.radians(self.magnet_elevation_deg)
        direction = (
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        )
        return self.magnet_modulus_A_m2 * np.array(direction)


class Albedo(Section):
    """Sunlight from the Earth; both factors are nominal values, the fit may free them."""

    specular: float = Field(
        default=MUNIN["albedo"]["specular"], ge=0, le=1, description="mirror reflectivity of the Earth [1]"
    )
    diffuse: float = Field(
        default=MUNIN["albedo"]["diffuse"], ge=0, le=1, description="diffuse (Lambert) reflectivity of the Earth [1]"
    )


class SatelliteNumbers(Section):
    """A satellite of six panels, a magnet and two rods, and the Earth's light on it: a satellite file's content."""

    spacecraft: Spacecraft = Spacecraft()
    albedo: Albedo = Albedo()

    @property
    def largest_current_sum_mA(self) -> float:
        """The most that six panels can show: the Sun on three of them, and an albedo as bright as the Sun."""
        return 2.0 * math.sqrt(3.0) * self.spacecraft.imax_mA * max(self.spacecraft.gains)
