"""Every choice of a fit with its meaning, unit, limits and default."""

from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fitting.parameters.names import parse_free
from fitting.solvers.rules import AdaptiveRules
from jaxsat.setting_types import Interval, NonNegative, Positive, Section


def _free(value: object) -> object:
    if isinstance(value, list | tuple) and all(isinstance(item, str) for item in value):
        value = ",".join(value) or "state"
    if isinstance(value, str):
        parse_free(value)
    return value


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


class FitSettings(Section):
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
    adaptive: AdaptiveRules = Field(default=AdaptiveRules(), description="weights")

    @model_validator(mode="after")
    def _solver_of_weights(self):
        if self.adaptive.on and self.solver != "levenberg_marquardt":
            raise ValueError(
                f"adaptive weights are solved by levenberg_marquardt, not by {self.solver}: set one of them"
            )
        return self

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the free model parameters, in the order of the solver's unknowns."""
        return parse_free(self.free)

    @property
    def reading_sigma_mA(self) -> float:
        """1-sigma of one current, its rounding included."""
        return float(np.hypot(self.noise_mA, self.quantum_mA / np.sqrt(12.0)))

    @property
    def floor(self) -> float | None:
        """The largest current that reads as zero [A]; None where zero is a reading as any other."""
        return 0.5e-3 * self.quantum_mA if self.zero_is_floor else None
