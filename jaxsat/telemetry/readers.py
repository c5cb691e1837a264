"""A telemetry file of any format that is read here, as one cleaned session."""

from collections.abc import Sequence
from pathlib import Path

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


def read_telemetry(
    path: str | Path | Sequence[str | Path], satellite: Satellite, *, cleaning: CleaningSettings | None = None
) -> TableSession:
    """Returns the session of a table, or of several joined by time, or of one RAW_SUN file.

    A table (CSV or Parquet) is read by what the file of its satellite says of columns, units and stamps; a file that
    ends in .RAW_SUN is cleaned as `cleaning` says, and its columns have the names that `munin.sat.toml` gives them.
    Every row that is left out is in `rejections` with its reason. Raises `InputError` with file, row and field where
    the file is none, or nothing usable is left of it.
    """
    paths = [Path(path)] if isinstance(path, str | Path) else [Path(each) for each in path]
    raw_sun = [each for each in paths if each.suffix.upper() == RAW_SUN]
    if raw_sun and len(paths) > 1:
        raise InputError("is one session by itself: tables alone are joined", file=raw_sun[0])
    if raw_sun:
        return _raw_sun_table(raw_sun[0], satellite, cleaning or CleaningSettings())
    return read_tables(paths, satellite)


def read_session(
    path: str | Path, numbers: SatelliteNumbers | None = None, *, cleaning: CleaningSettings | None = None
) -> Session:
    """Returns the cleaned session of a RAW_SUN file of a satellite of Munin's kind, Munin where no `numbers` are given.

    They say how much light its panels can see. Raises `InputError` as `read_telemetry`.
    """
    return clean(read_raw_sun(Path(path)), cleaning, numbers)


def _raw_sun_table(path: Path, satellite: Satellite, cleaning: CleaningSettings) -> TableSession:
    from jaxsat.telemetry.raw_sun.table import largest_current_sum_mA, table_of

    most = cleaning.max_current_sum_mA or largest_current_sum_mA(satellite)
    return table_of(clean(read_raw_sun(path), cleaning.model_copy(update={"max_current_sum_mA": most})), satellite)
