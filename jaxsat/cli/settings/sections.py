"""Every setting of a fit with its meaning, unit, limits and default.

Where the default is None, the value is found from the session itself (Penkov et al. 2009, section 2.3: what `Start`
writes into `globP`); names of that module's parameters stand in the descriptions.
"""

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from fitting.parameters.names import parse_free
from jaxsat.cli.settings.simulate import Simulate
from jaxsat.cli.settings.types import Angle, Interval, NonNegative, Positive, Section, Tilt, Vector
from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.telemetry.raw_sun.cleaning import PANELS, CleaningSettings


def _each_panel_once(order: tuple[str, ...]) -> tuple[str, ...]:
    order = tuple(panel.upper() for panel in order)
    if sorted(order) != sorted(PANELS):
        raise ValueError(f"expected each of {', '.join(PANELS)} once")
    return order


def _unit(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if abs(math.hypot(*vector) - 1.0) > 1e-3:
        raise ValueError(f"expected a unit vector, its length is {math.hypot(*vector):.6g}")
    return vector


def _free(value: object) -> object:
    if isinstance(value, list) and all(isinstance(item, str) for item in value):
        value = ",".join(value)
    if isinstance(value, str):
        parse_free(value)
    return value


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
        default=None, description="time of perigee passage after t = 0, tper [s]", examples=[3230.533197]
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
        default=0.0, description="start of the new time scale after the earliest good sample, t00 [s]"
    )


class Earth(Section):
    """The Earth's figure and rotation."""

    radius_km: Positive = Field(default=6371.2, description="radius for shadow and albedo, Rzem [km]")
    rotation_rate_rad_s: float = Field(default=EARTH_ROTATION_RATE, description="rotation rate, Omz [rad/s]")
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

    def greenwich_angle(self, time_of_perigee_s: float) -> float | None:
        """Right ascension of Greenwich at t = 0 [rad]; None where it follows from the epoch."""
        if self.greenwich_angle_at_perigee_deg is not None:
            return math.radians(self.greenwich_angle_at_perigee_deg) - self.rotation_rate_rad_s * time_of_perigee_s
        return None if self.greenwich_angle_deg is None else math.radians(self.greenwich_angle_deg)


class Sun(Section):
    """Direction to the Sun."""

    direction_eci: Annotated[Vector, AfterValidator(_unit)] | None = Field(
        default=None,
        description="unit vector to the Sun, inertial axes, held fixed, SX0 SY0 SZ0 [1]",
        examples=[[0.47176670, -0.80932067, -0.34990890]],
    )


class Inertia(Section):
    """Inertia tensor about the centre of mass, body axes; xy is the tensor's entry J(1,2) itself."""

    xx: float = Field(default=0.05283, description="J(1,1) [kg m2]")
    yy: float = Field(default=0.05283, description="J(2,2) [kg m2]")
    zz: float = Field(default=0.05283, description="J(3,3) [kg m2]")
    xy: float = Field(default=0.0, description="J(1,2) [kg m2]")
    xz: float = Field(default=0.0, description="J(1,3) [kg m2]")
    yz: float = Field(default=0.0, description="J(2,3) [kg m2]")

    @model_validator(mode="after")
    def _of_a_body(self):
        low, middle, high = np.linalg.eigvalsh(self.tensor()).tolist()
        if not low > 0.0:
            raise ValueError(f"tensor is not positive definite: its smallest principal moment is {low:.6g} kg m2")
        if high > (low + middle) * (1.0 + 1e-9):
            raise ValueError(
                f"no body has these principal moments: {high:.6g} exceeds the sum of {low:.6g} and {middle:.6g} kg m2"
            )
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
    magnet_modulus_A_m2: NonNegative = Field(default=0.3, description="magnet's dipole moment, Imag [A m2]")
    magnet_azimuth_deg: Angle = Field(default=0.0, description="its azimuth from body x towards y, alf [deg]")
    magnet_elevation_deg: float = Field(
        default=0.0, ge=-90, le=90, description="its elevation above the body xy plane, bet [deg]"
    )
    rods_A_m2: Annotated[tuple[NonNegative, NonNegative], Field(strict=False)] = Field(
        default=(0.03, 0.03), description="moments of the rods along body y and z in the reference field, I2 I3 [A m2]"
    )
    reference_field_T: Positive = Field(default=3.0e-5, description="field in which rods_A_m2 is quoted [T]")
    imax_mA: Positive = Field(default=240.0, description="current of a panel facing the Sun, Imax [mA]")
    gains: Annotated[tuple[Positive, Positive, Positive, Positive, Positive, Positive], Field(strict=False)] = Field(
        default=(1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
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

    specular: float = Field(default=0.0, ge=0, le=1, description="mirror reflectivity of the Earth [1]")
    diffuse: float = Field(default=0.0, ge=0, le=1, description="diffuse (Lambert) reflectivity of the Earth [1]")


class Cleaning(Section):
    """What is wrong in a file and what is left out by hand."""

    max_date_difference_days: Positive = Field(
        default=1.0, description="furthest a row may be from the first, dif_Date [d]"
    )
    panel_order: Annotated[tuple[str, ...], Field(strict=False), AfterValidator(_each_panel_once)] = Field(
        default=PANELS, description="panels of the file's six current columns"
    )
    max_current_sum_mA: Positive | None = Field(
        default=None,
        description="largest believable sum of the six currents [mA]; 2 sqrt(3) imax_mA x largest gain if left out",
        examples=[830.0],
    )
    max_sum_mismatch_mA: Positive = Field(
        default=20.0, description="largest difference of the sum column from the six currents [mA]"
    )
    max_field_uT: Positive = Field(default=100.0, description="largest believable magnetometer reading, Bmax [uT]")
    drop_s: Annotated[tuple[Interval, ...], Field(strict=False)] = Field(
        default=(), description="intervals [t0, t1] after the earliest good sample left out by hand [s]"
    )


class PriorSigma(Section):
    """Weak priors about the nominal values, 1-sigma."""

    magnet_A_m2: Positive = Field(default=0.05, description="each component [A m2]")
    rods_A_m2: Positive = Field(default=0.05, description="each rod [A m2]")
    imax_relative: Positive = Field(default=0.2, description="relative to imax_mA [1]")
    gains: Positive = Field(default=0.1, description="each gain [1]")
    inertia_relative: Positive = Field(
        default=0.15, description="each entry, relative to the mean moment of inertia [1]"
    )
    albedo: Positive = Field(default=0.5, description="each reflectivity [1]")
    tilts_deg: Positive = Field(default=2.0, description="each turn of a panel [deg]")


class Adaptive(Section):
    """The adaptive weights of the program `als`, for a model without albedo, in place of `likelihood`."""

    on: bool = Field(default=False, description="use them")
    passes: int = Field(default=4, ge=1, le=100, description="solutions with renewed weights, K_iter")
    limiting_ratio: float = Field(
        default=0.85, ge=0, le=1, description="rule 1: doubt samples below this share of the possible sum [1]; 0 is off"
    )
    limiting_power: NonNegative = Field(default=4.0, description="power of measured over that share of it [1]")
    large_gain: NonNegative = Field(
        default=1.0, description="rule 2: weight x 1 + gain (current / imax)^2 [1]; 0 is off"
    )
    small_mA: NonNegative = Field(default=20.0, description="rule 3: currents below this [mA]")
    small_factor: float = Field(default=0.3, ge=0, le=1, description="are weighed by this [1]; 1 is off")
    away_factor: Positive = Field(
        default=2.0, description="rule 4: factor of panels that cannot see the Earth [1]; 1 is off"
    )
    axis_factors: Annotated[tuple[Positive, Positive, Positive], Field(strict=False)] = Field(
        default=(1.0, 1.0, 1.0), description="rule 5: factors of the panels on x, y, z [1]"
    )
    specular_alpha: NonNegative = Field(
        default=1.0, description="rule 6: weight / (1 + alpha I_alb / (I_sun + delta)) at each pass [1]; 0 is off"
    )
    specular_delta_mA: Positive = Field(default=10.0, description="its delta [mA]")
    specular_reflectivity: float = Field(default=0.5, ge=0, le=1, description="of the Earth, for its I_alb [1]")
    zero_in_shadow: bool = Field(default=True, description="take currents in the Earth's shadow for zero")
    zero_turned_away: bool = Field(default=True, description="and those of panels turned away from the Sun")


class Fit(Section):
    """What is fitted, to which samples and how hard it is tried."""

    free: Annotated[str, BeforeValidator(_free)] = Field(
        default="state,magnet,rods,imax,inertia,albedo",
        description="free parameters: groups state magnet rods imax gains inertia albedo tilts, single ones as "
        "magnet.azimuth, or als alsI0 alsI23 ...",
    )
    arc_s: Interval | None = Field(
        default=None, description="fit only samples in [t0, t1] after t = 0 [s]", examples=[[0.0, 2700.0]]
    )
    starts: int = Field(default=256, ge=1, le=65536, description="random starts of the search")
    seed: int = Field(default=0, ge=0, lt=2**32, description="seed of the starts")
    noise_mA: Positive = Field(default=2.0, description="1-sigma of a current [mA]")
    quantum_mA: NonNegative = Field(default=1.0, description="step in which currents are telemetered [mA]")
    zero_is_floor: bool = Field(
        default=True,
        description="a current of 0 was half a step or less, for the telemetry has nothing below it; false where 0 is "
        "a current as any other",
    )
    max_rate_deg_s: Positive = Field(default=1.5, le=30, description="highest angular rate of the starts [deg/s]")
    step_s: float = Field(
        default=32.0, gt=0, le=60, description="longest integration step; shorter where the rate asks for it [s]"
    )
    likelihood: Literal["mixture", "student", "trimmed", "normal"] = Field(
        default="mixture",
        description="what may be wrong with a sample, as under a limited charge current: mixture (a state of each, "
        "estimated), student (heavy tails), trimmed (left out by its residuals), normal (nothing)",
    )
    solver: Literal["levenberg_marquardt", "lbfgs", "adam"] = Field(
        default="levenberg_marquardt",
        description="solver of the last steps: levenberg_marquardt, or, to compare, lbfgs (10 times as long), adam "
        "(gradient descent, 100 times)",
    )
    limb_sigma_deg: float = Field(
        default=0.5, gt=0, le=180, description="1-sigma of a limb angle of --limb, on the sphere [deg]"
    )
    limb_weight: NonNegative = Field(
        default=1.0, description="factor of the limb angles' inverse variance, vesABlimb [1]; 0 ignores their file"
    )
    prior_sigma: PriorSigma = Field(default=PriorSigma(), description="priors")
    adaptive: Adaptive = Field(default=Adaptive(), description="weights")

    @model_validator(mode="after")
    def _solver_of_weights(self):
        if self.adaptive.on and self.solver != "levenberg_marquardt":
            raise ValueError(
                f"adaptive weights are solved by levenberg_marquardt, not by {self.solver}: set one of them"
            )
        return self


class Config(Section):
    """All settings of `jaxsat prepare`, `jaxsat fit` and `jaxsat simulate`; one file may serve them all."""

    orbit: Orbit = Orbit()
    time: Time = Time()
    earth: Earth = Earth()
    sun: Sun = Sun()
    spacecraft: Spacecraft = Spacecraft()
    albedo: Albedo = Albedo()
    cleaning: Cleaning = Cleaning()
    fit: Fit = Fit()
    simulate: Simulate = Simulate()

    def of_a_fit(self) -> dict[str, Any]:
        """All settings that a preparation or a fit reads, as plain values."""
        return self.model_dump(mode="json", exclude={"simulate"})

    def cleaning_settings(self) -> CleaningSettings:
        """Settings of `clean`, with the limit on the sum of currents taken from the panels where it is left out."""
        cleaning = self.cleaning
        largest = self.spacecraft.imax_mA * max(self.spacecraft.gains)
        return CleaningSettings(
            max_date_difference_days=cleaning.max_date_difference_days,
            panel_order=cleaning.panel_order,
            max_current_sum_mA=cleaning.max_current_sum_mA or 2.0 * math.sqrt(3.0) * largest,
            max_sum_mismatch_mA=cleaning.max_sum_mismatch_mA,
            max_field_uT=cleaning.max_field_uT,
            drop_s=cleaning.drop_s,
        )
