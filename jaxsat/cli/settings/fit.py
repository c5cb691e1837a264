"""The section `[fit]` of a configuration: what is fitted of a satellite of Munin's kind, and how hard it is tried."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from fitting.settings import FitSettings
from fitting.solvers.rules import AdaptiveRules
from jaxsat.satellites.described import PriorSigma, Readings
from jaxsat.setting_types import Interval, NonNegative, Positive


def _free(value: object) -> object:
    if isinstance(value, list | tuple) and all(isinstance(item, str) for item in value):
        return ",".join(value) or "state"
    return value


class FitSection(Readings):
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
        self.adaptive.check_solver(self.solver)
        return self

    @property
    def settings(self) -> FitSettings:
        """Those of them that are not of the satellite."""
        free = tuple(part.strip() for part in self.free.split(","))
        shared = type(self).model_fields.keys() & FitSettings.model_fields.keys()
        return FitSettings.model_validate({name: getattr(self, name) for name in shared} | {"free": free})
