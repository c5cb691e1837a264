"""Numbers of the adaptive weights: see `fitting.solvers.adaptive`."""

from typing import Annotated

from pydantic import Field

from jaxsat.setting_types import NonNegative, Positive, Section


class AdaptiveRules(Section):
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

    def check_solver(self, solver: str) -> None:
        """Raises ValueError for a solver that does not know the weights."""
        if self.on and solver != "levenberg_marquardt":
            raise ValueError(f"adaptive weights are solved by levenberg_marquardt, not by {solver}: set one of them")
