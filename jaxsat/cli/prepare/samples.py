"""The table of a cleaned session."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jaxsat.files.csv_files import write_numbers_csv
from jaxsat.panel_names import PANEL_NAMES

if TYPE_CHECKING:
    from jaxsat.telemetry import Session

SAMPLE_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    **{f"position_{c}_km": "position, inertial equatorial axes" for c in "xyz"},
    **{f"velocity_{c}_km_s": "velocity, inertial equatorial axes" for c in "xyz"},
    **{f"current_{p}_mA": "panel current" for p in PANEL_NAMES},
    **{f"field_{c}_uT": "magnetometer, body axes; empty where there is no reading" for c in "yz"},
    "rows": "rows of the file averaged into the sample",
}
"""Columns of samples.csv."""


def write_samples_csv(path: Path, session: "Session") -> None:
    """Writes a cleaned session, one row a sample, with the columns of `SAMPLE_COLUMNS`."""
    kilometres = session.position_eci_m / 1e3, session.velocity_eci_m_s / 1e3
    numbers = np.column_stack([*kilometres, session.currents_mA, session.b_field_uT, session.repeats])
    write_numbers_csv(path, SAMPLE_COLUMNS, session.t_s, session.epoch, numbers)
