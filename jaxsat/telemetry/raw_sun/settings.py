"""What counts as wrong in a RAW_SUN file, and what is left out by hand."""

from typing import Annotated

from pydantic import AfterValidator, Field

from jaxsat.panel_names import PANEL_NAMES
from jaxsat.setting_types import Interval, Positive, Section

PANELS = tuple(name.upper() for name in PANEL_NAMES)
"""The panels as files and settings name them, in natural order."""


def _each_panel_once(order: tuple[str, ...]) -> tuple[str, ...]:
    order = tuple(panel.upper() for panel in order)
    if sorted(order) != sorted(PANELS):
        raise ValueError(f"expected each of {', '.join(PANELS)} once")
    return order


class CleaningSettings(Section):
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
