"""Where a simulated session gets its orbit, its instant and its commands from."""

from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.units import parsed_unit
from jaxsat.satellites import Satellite
from jaxsat.synthetic.twins.readings import Columns
from jaxsat.synthetic.twins.settings import TwinSettings
from jaxsat.telemetry.table.cells import numbers
from jaxsat.telemetry.table.flown import first_instant
from jaxsat.telemetry.table.flown import with_orbit as with_orbit
from jaxsat.telemetry.table.raw import read_raw_table
from jaxsat.telemetry.table.stamps import instants, seconds_after
from jaxsat.time import Epoch

TIME_COLUMN = "t_s"


def epoch_of(satellite: Satellite, settings: TwinSettings) -> Epoch:
    """Instant of t = 0: the given one, or `first_instant`."""
    return first_instant(satellite, settings.start_utc)


def read_columns(path: Path, satellite: Satellite, epoch: Epoch) -> Columns:
    """Commands and measured currents of a table, in the units of the satellite file.

    Its times are `t_s`, seconds after the epoch, or stamps as the satellite file has them. Raises `InputError` with
    row and column for what is none.
    """
    table = read_raw_table(path)
    if TIME_COLUMN in table.columns:
        t = numbers(table, TIME_COLUMN)
    else:
        t = seconds_after(instants(table, satellite.time), epoch.tai())
    found = {}
    for name in table.columns:
        if name in satellite.columns:
            values = numbers(table, name) * parsed_unit(satellite.columns[name]).factor
            known = np.isfinite(t) & np.isfinite(values)
            backward = np.flatnonzero(np.diff(t[known]) <= 0.0)
            if backward.size or not known.any():
                row = int(table.rows[np.flatnonzero(known)[backward[0] + 1]]) if backward.size else None
                reason = "expected times that rise" if backward.size else "holds no number"
                raise InputError(reason, file=path, row=row, field=name)
            found[name] = (t[known], values[known])
    if not found:
        known = ", ".join(satellite.columns) or "none"
        raise InputError(f"holds no column of the satellite file; there are {known}", file=path)
    return found
