"""Writing a RAW_SUN session file, in the layout that `raw_sun` reads."""

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxsat.time import Epoch

NO_READING_UT = 999.9
"""What a magnetometer without a reading telemeters."""


def raw_sun_text(
    satellite: str,
    tle: tuple[str, str],
    epoch: Epoch,
    t_s: Float[np.ndarray, "time"],
    *,
    position_eci_m: Float[np.ndarray, "time 3"],
    velocity_eci_m_s: Float[np.ndarray, "time 3"],
    currents_mA: Float[np.ndarray, "time 6"],
    b_field_uT: Float[np.ndarray, "time 2"],
    received: Epoch,
    panel_order: Sequence[int] = (0, 1, 2, 3, 4, 5),
    current_decimals: int = 0,
) -> str:
    """Returns the text of a session file, one row a sample in order of time, LF line ends.

    `t_s` are seconds after `epoch`, written to the millisecond; currents are those of the panels +X -X +Y -Y +Z -Z and
    go to the columns in `panel_order`; the magnetometer's components are body y and z, NaN where it has no reading;
    all rows are `received` on the ground at one instant.
    """
    columns = currents_mA[:, list(panel_order)]
    field = np.where(np.isfinite(b_field_uT), b_field_uT, NO_READING_UT)
    # The sum of what is written, as on board it is the sum of what is measured.
    total = np.round(columns, current_decimals).sum(axis=1)
    numbers = np.column_stack([position_eci_m / 1e3, velocity_eci_m_s / 1e3, columns, total, field])
    current = f" %5.{current_decimals}f"
    pattern = " %12.3f" * 3 + " %10.6f" * 3 + current * 7 + " %8.2f" * 2
    reception = _time(received.iso(3))
    rows = zip(epoch.iso_texts(t_s, 3), numbers.tolist(), strict=True)
    lines = [f"{_time(instant)}  {reception}" + pattern % tuple(row) for instant, row in rows]
    return "\n".join([satellite, *tle, *lines]) + "\n"


def _time(instant: str) -> str:
    """Year, month, day, hour, minute and second of an ISO instant in columns."""
    return _LEADING_ZERO.sub("  ", instant.translate(_TO_BLANKS))


_TO_BLANKS = str.maketrans("-T:", "   ")
_LEADING_ZERO = re.compile(r" 0(?=\d)")
