"""The tables of a fit of any satellite: attitude.csv and one a channel."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fitting.outcome.sensed_result import ChannelFit, SensedResult
from fitting.report.document import ATTITUDE_COLUMNS
from fitting.report.sensed.shown import readings_of
from jaxsat.files.csv_files import write_numbers_csv
from jaxsat.plotting.channels import Readings
from jaxsat.time import Epoch

SENSED_ATTITUDE_COLUMNS = {
    **{name: text for name, text in ATTITUDE_COLUMNS.items() if name not in ("lit", "limited")},
    "lit": "visible share of the Sun, 0 in the Earth's shadow",
    "fitted": "0 where it was held out of the fit",
}
"""Columns of attitude.csv; an empty field stands for a number that is not known."""
TIME_COLUMNS = {name: ATTITUDE_COLUMNS[name] for name in ("t_s", "utc")}
FLAGS = {"fitted": "0 where it was held out of the fit", "used": "0 where it was left out as an outlier or in doubt"}


def write_sensed_attitude(path: Path, result: SensedResult, epoch: Epoch) -> None:
    """Writes one row a time with the columns of `SENSED_ATTITUDE_COLUMNS`."""
    unknown = np.full(len(result.t_s), np.nan)
    numbers = np.column_stack(
        [
            result.quaternion_inertial_from_body,
            result.angular_velocity_rad_s,
            result.attitude_sigma_deg,
            *(
                unknown if array is None else array
                for array in (result.field_angle_deg, result.field_angle_sigma_deg, result.illumination)
            ),
            result.fitted,
        ]
    )
    write_numbers_csv(path, SENSED_ATTITUDE_COLUMNS, result.t_s, epoch, numbers)


def channel_columns(readings: Readings, unit: str) -> dict[str, str]:
    """Names and meanings of the columns of a channel's table."""
    own = [_with_unit(name, unit) for name in readings.columns]
    turns = [name.replace(" ", "_") for name in readings.differences]
    return {
        **TIME_COLUMNS,
        **{f"measured_{name}": "as the telemetry has it, a quaternion with the sign of the model" for name in own},
        **{f"modelled_{name}": "by the fit, without noise" for name in own},
        **{f"residual_{name}_sigma": "measured less modelled, in sigmas of a reading" for name in turns},
        **{f"promised_{name}_sigma": "its 1-sigma by noise and covariance of the fit" for name in turns},
        **FLAGS,
    }


def write_channel(path: Path, channel: ChannelFit, epoch: Epoch) -> Mapping[str, str]:
    """Writes one row a sample of a channel; returns names and meanings of the columns."""
    r = readings_of(channel)
    columns = channel_columns(r, channel.unit)
    flags = [channel.fitted, channel.used]
    numbers = np.column_stack([r.measured, r.modelled, r.residual, r.promised, *flags])
    write_numbers_csv(path, columns, r.t_s, epoch, numbers)
    return columns


def _with_unit(name: str, unit: str) -> str:
    ending = unit.replace("/", "_").replace(" ", "_")
    return name if unit == "1" or name.endswith(f"_{ending}") else f"{name}_{ending}"
