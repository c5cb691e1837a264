"""The numbers that the report's script draws, small enough for a page."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.files.json_files import plain
from jaxsat.panel_names import PANEL_COLOURS
from jaxsat.plotting.current_marks import current_marks

if TYPE_CHECKING:
    from fitting.outcome.result import FitResult

SCHEMA = "jaxsat.page/1"


def page_data(result: "FitResult", scene: Mapping[str, Any] | None, epoch_utc: str) -> dict[str, Any]:
    """Returns the data block of a report; numbers that are not finite are null. `scene` is as in scene.json."""
    r = result
    lit, limited = r.lit.astype(bool), r.limited.astype(bool)
    marks = current_marks(r.measured_mA, r.weight, lit, limited)
    # 0 sees nothing, 1 used, 2 weighted down, 3 left out.
    use = marks.used.astype(int) + marks.reduced + 3 * marks.left_out
    samples = {
        "t_s": np.round(r.t_s, 3),
        "measured_mA": np.round(r.measured_mA, 3),
        "modelled_mA": np.round(r.modelled_mA, 3),
        "direct_mA": np.round(r.modelled_direct_mA, 3),
        "use": use,
        "lit": lit.astype(int),
        "field_angle_deg": np.round(r.field_angle_deg, 3),
        "field_angle_sigma_deg": np.round(r.field_angle_sigma_deg, 4),
        "attitude_sigma_deg": np.round(r.attitude_sigma_deg, 4),
        "rate_deg_s": np.round(np.degrees(r.angular_velocity_rad_s), 4),
    }
    document = {
        "schema": SCHEMA,
        "epoch_utc": epoch_utc,
        "panels": [{"name": name.upper(), "colour": colour} for name, colour in PANEL_COLOURS.items()],
        "samples": samples,
    }
    # The scene is plain already.
    return {**plain(document)[0], "scene": scene}
