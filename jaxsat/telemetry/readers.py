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

RAW_SUN = ".RAW_SUN"
"""Ending of the files of Munin."""


@overload
def read_telemetry(
    path: str | Path | Sequence[str | Path], satellite: Satellite, *, cleaning: CleaningSettings | None = None
) -> TableSession: ...
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

    A table (CSV or Parquet) is read by what the file of its satellite says of columns, units and stamps, and so is a
    file that ends in .RAW_SUN with a satellite that has sensors; else a RAW_SUN file is that of a satellite of Munin's
    kind, Munin where none is given, whose numbers say how much light its panels can see. Every row that is left out is
    in `rejections` with its reason. Raises `InputError` with file, row and field where the file is none, or nothing
    usable is left of it.
    """
    if isinstance(satellite, Satellite):
        paths = [Path(path)] if isinstance(path, str | Path) else [Path(each) for each in path]
        raw_sun = [each for each in paths if each.suffix.upper() == RAW_SUN]
        if raw_sun and len(paths) > 1:
            raise InputError("is one session by itself: tables alone are joined", file=raw_sun[0])
        if raw_sun:
            return _raw_sun_table(raw_sun[0], satellite, cleaning or CleaningSettings())
        return read_tables(paths, satellite)
    if not isinstance(path, str | Path):
        raise InputError("several files are one session only as tables, with a satellite file that has [sensors]")
    return clean(read_raw_sun(Path(path)), cleaning, satellite)


def _raw_sun_table(path: Path, satellite: Satellite, cleaning: CleaningSettings) -> TableSession:
    from jaxsat.telemetry.raw_sun.table import largest_current_sum_mA, table_of

    most = cleaning.max_current_sum_mA or largest_current_sum_mA(satellite)
    return table_of(clean(read_raw_sun(path), cleaning.model_copy(update={"max_current_sum_mA": most})), satellite)
