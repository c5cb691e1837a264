"""Where a simulated session gets its orbit, its instant and its commands from."""

import dataclasses
import math
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.units import parsed_unit
from jaxsat.satellites import Satellite
from jaxsat.satellites.sections.session import OrbitSettings
from jaxsat.synthetic.twins.readings import Columns
from jaxsat.synthetic.twins.settings import TwinSettings
from jaxsat.telemetry.ccsds.oem import read_oem
from jaxsat.telemetry.table.cells import numbers
from jaxsat.telemetry.table.orbit import MARGIN_S, beside, element_set_at
from jaxsat.telemetry.table.raw import read_raw_table
from jaxsat.telemetry.table.stamps import instants, seconds_after
from jaxsat.time import Epoch

TIME_COLUMN = "t_s"
_OEM_MARKS = (b"CCSDS_OEM_VERS", b"<oem")
_HEAD_BYTES = 4096


def with_orbit(satellite: Satellite, path: Path) -> Satellite:
    """The satellite on the orbit of a file: element sets (TLE, OMM), or an ephemeris (OEM), told by what it holds."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    place = str(path.absolute())
    ephemeris = any(mark in head for mark in _OEM_MARKS)
    return dataclasses.replace(satellite, orbit=OrbitSettings(oem=place) if ephemeris else OrbitSettings(tle=place))


def epoch_of(satellite: Satellite, settings: TwinSettings) -> Epoch:
    """Instant of t = 0: the given one, that from which stamps count seconds, or the epoch of the orbit's elements.

    Of element sets the whole second after the first one's epoch, of an ephemeris after its beginning.
    """
    orbit, given = satellite.orbit, settings.start_utc or satellite.time.epoch
    if given is not None:
        return Epoch.from_iso(given)
    if orbit.columns is not None:
        reason = "the positions are in the table that is to be made: give the orbit as elements or as an ephemeris"
        raise InputError(reason, file=satellite.path, field="orbit.columns")
    if orbit.elements is not None:
        return Epoch.from_iso(orbit.elements.epoch)
    if orbit.oem is not None:
        segment = read_oem(beside(satellite, orbit.oem))[0]
        found = segment.epoch.shifted(float(segment.t_s[0]) + MARGIN_S)
    else:
        elements = element_set_at(satellite, None)
        assert elements is not None
        found = elements.epoch
    whole = Epoch.from_iso(found.iso(0))
    return whole.shifted(math.ceil(round(found.seconds_since(whole), 6)))


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
