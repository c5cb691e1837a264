"""Choices of a fit of any satellite."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from fitting.solvers.rules import AdaptiveRules
from jaxsat.setting_types import Interval, Positive, Section


def _names(value: object) -> object:
    return [name.strip() for name in value.split(",")] if isinstance(value, str) else value


class FitSettings(Section):
    """What is fitted, to which part of the table, and how hard it is tried."""

    free: Annotated[Annotated[tuple[str, ...], Field(strict=False)] | None, BeforeValidator(_names)] = Field(
        default=None,
        description="names of leaves, or prefixes of them as magnet or mag.bias; by default everything with a sigma",
    )
    holdout: float = Field(default=0.0, ge=0.0, le=0.9, description="share of the time, at its end, that is predicted")
    arc_s: Interval | None = Field(default=None, description="use only samples in [t0, t1] after t = 0 [s]")
    starts: int = Field(default=64, ge=1, le=65536, description="starts of the search under each convention of axes")
    seed: int = Field(default=0, ge=0, lt=2**32, description="seed of the starts")
    max_rate_deg_s: Positive = Field(
        default=1.5, le=720, description="highest angular rate of the starts where no sensor shows a higher one [deg/s]"
    )
    step_s: float = Field(default=32.0, gt=0, le=60, description="longest integration step [s]")
    likelihood: Literal["mixture", "student", "trimmed", "normal"] = Field(
        default="mixture", description="what may be wrong with a sample of a sensor"
    )
    solver: Literal["levenberg_marquardt", "lbfgs", "adam"] = Field(
        default="levenberg_marquardt",
        description="solver of the last steps: levenberg_marquardt, or, to compare, lbfgs (10 times as long), adam "
        "(gradient descent, 100 times)",
    )
    adaptive: AdaptiveRules = Field(
        default=AdaptiveRules(), description="weights of panel currents, in place of likelihood"
    )

    @model_validator(mode="after")
    def _solver_of_weights(self):
        self.adaptive.check_solver(self.solver)
        return self
