"""A telemetry file of any format that is read here, as one cleaned session."""

from collections.abc import Sequence
from pathlib import Path
from typing import overload

from jaxsat.errors import InputError
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.satellites.satellite import Satellite
from jaxsat.telemetry.raw_sun.cleaning import Session, clean
from jaxsat.telemetry.raw_sun.reading import read_raw_sun
from jaxsat.telemetry.raw_sun.settings import CleaningSettings
from jaxsat.telemetry.table.reading import read_tables
from jaxsat.telemetry.table.session import TableSession


@overload
def read_telemetry(path: str | Path | Sequence[str | Path], satellite: Satellite) -> TableSession: ...
@overload
def read_telemetry(
    path: str | Path, satellite: SatelliteNumbers | None = None, *, cleaning: CleaningSettings | None = None
) -> Session: ...
@overload
def read_telemetry(
    path: str | Path, satellite: SatelliteNumbers | Satellite | None, *, cleaning: CleaningSettings | None = None
) -> Session | TableSession: ...
def read_telemetry(
    path: str | Path | Sequence[str | Path],
    satellite: SatelliteNumbers | Satellite | None = None,
    *,
    cleaning: CleaningSettings | None = None,
) -> Session | TableSession:
    """Returns the session of a table, or of several joined by time, or of a RAW_SUN file.

    A table (CSV or Parquet) is read by what the file of its satellite says of columns, units and stamps; a RAW_SUN file
    is that of a satellite of Munin's kind, Munin where none is given, whose numbers say how much light its panels can
    see. Every row that is left out is in `rejections` with its reason. Raises `InputError` with file, row and field
    where the file is none, or nothing usable is left of it.
    """
    if isinstance(satellite, Satellite):
        return read_tables(path, satellite)
    if not isinstance(path, str | Path):
        raise InputError("several files are one session only as tables, with a satellite file that has [sensors]")
    return clean(read_raw_sun(Path(path)), cleaning, satellite)
