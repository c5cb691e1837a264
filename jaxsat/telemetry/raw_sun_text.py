"""Writing a RAW_SUN session file, in the layout that `raw_sun` reads."""

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
    reception = _time(received.iso(3))
    lines = [satellite, *tle]
    rows = zip(
        epoch.iso_texts(t_s, 3),
        (position_eci_m / 1e3).tolist(),
        (velocity_eci_m_s / 1e3).tolist(),
        columns.tolist(),
        # The sum of what is written, as on board it is the sum of what is measured.
        np.round(columns, current_decimals).sum(axis=1).tolist(),
        field.tolist(),
        strict=True,
    )
    for instant, position, velocity, currents, total, magnetometer in rows:
        currents_text = " ".join(f"{x:5.{current_decimals}f}" for x in (*currents, total))
        lines.append(
            f"{_time(instant)}  {reception} "
            f"{position[0]:12.3f} {position[1]:12.3f} {position[2]:12.3f} "
            f"{velocity[0]:10.6f} {velocity[1]:10.6f} {velocity[2]:10.6f} "
            f"{currents_text} {magnetometer[0]:8.2f} {magnetometer[1]:8.2f}"
        )
    return "\n".join(lines) + "\n"


def _time(instant: str) -> str:
    """Year, month, day, hour, minute and second of an ISO instant in columns."""
    date, clock = instant.split("T")
    year, month, day = date.split("-")
    hour, minute, second = clock.split(":")
    return f"{year} {int(month):2d} {int(day):2d} {int(hour):2d} {int(minute):2d} {float(second):6.3f}"
