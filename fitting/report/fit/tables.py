"""The tables of a fit of any satellite: attitude.csv and one a channel."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fitting.outcome.result import ChannelFit, FitResult
from fitting.report.fit.shown import readings_of
from jaxsat.files.csv_files import write_numbers_csv
from jaxsat.plotting.channels import Readings
from jaxsat.time import Epoch

TIME_COLUMNS = {"t_s": "seconds since the epoch", "utc": "UTC"}
ATTITUDE_COLUMNS = {
    **TIME_COLUMNS,
    **{f"q_{c}": "attitude quaternion, scalar first, turns body axes into inertial ones" for c in "wxyz"},
    **{f"rate_{c}_rad_s": "angular velocity about the body axes" for c in "xyz"},
    **{f"attitude_sigma_{c}_deg": "1-sigma of a small rotation about the body axes" for c in "xyz"},
    "field_angle_deg": "angle between body x and the magnetic field",
    "field_angle_sigma_deg": "its 1-sigma",
    "lit": "visible share of the Sun, 0 in the Earth's shadow",
    "limited": "1 where every light sensor's sample was left out as current-limited or outlying",
    "fitted": "0 where it was held out of the fit",
}
"""Columns of attitude.csv; an empty field stands for a number that is not known."""
WEIGHT = "weight with which it was fitted, 0 where it was not or says nothing"
FLAGS = {"fitted": "0 where it was held out of the fit", "used": "0 where it was left out as an outlier or in doubt"}


def write_attitude(path: Path, result: FitResult, epoch: Epoch) -> None:
    """Writes one row a time with the columns of `ATTITUDE_COLUMNS`."""
    unknown = np.full(len(result.t_s), np.nan)
    numbers = np.column_stack(
        [
            result.quaternion_inertial_from_body,
            result.angular_velocity_rad_s,
            result.attitude_sigma_deg,
            *(
                unknown if array is None else array
                for array in (
                    result.field_angle_deg,
                    result.field_angle_sigma_deg,
                    result.illumination,
                    result.limited,
                )
            ),
            result.fitted,
        ]
    )
    write_numbers_csv(path, ATTITUDE_COLUMNS, result.t_s, epoch, numbers)


def channel_columns(readings: Readings, unit: str, *, weighed: bool) -> dict[str, str]:
    """Names and meanings of the columns of a channel's table."""
    own = [_with_unit(name, unit) for name in readings.columns]
    turns = [name.replace(" ", "_") for name in readings.differences]
    return {
        **TIME_COLUMNS,
        **{f"measured_{name}": "as the telemetry has it, a quaternion with the sign of the model" for name in own},
        **{f"modelled_{name}": "by the fit, without noise" for name in own},
        **({} if readings.direct is None else {f"direct_{name}": "the part of direct sunlight in it" for name in own}),
        **{f"residual_{name}_sigma": "measured less modelled, in sigmas of a reading" for name in turns},
        **{f"promised_{name}_sigma": "its 1-sigma by noise and covariance of the fit" for name in turns},
        **({f"weight_{name}": WEIGHT for name in turns} if weighed else {}),
        **FLAGS,
    }


def write_channel(path: Path, channel: ChannelFit, epoch: Epoch) -> Mapping[str, str]:
    """Writes one row a sample of a channel; returns names and meanings of the columns."""
    r = readings_of(channel)
    columns = channel_columns(r, channel.unit, weighed=channel.weight is not None)
    own, flags = (r.measured, r.modelled, r.direct, channel.residual, r.promised), (channel.fitted, channel.used)
    numbers = np.column_stack([array for array in (*own, channel.weight, *flags) if array is not None])
    write_numbers_csv(path, columns, r.t_s, epoch, numbers)
    return columns


def _with_unit(name: str, unit: str) -> str:
    ending = unit.replace("/", "_").replace(" ", "_")
    return name if unit == "1" or name.endswith(f"_{ending}") else f"{name}_{ending}"
