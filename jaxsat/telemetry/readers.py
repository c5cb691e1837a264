"""A telemetry file of any format that is read here, as one cleaned session."""

from pathlib import Path

from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.telemetry.raw_sun.cleaning import Session, clean
from jaxsat.telemetry.raw_sun.reading import read_raw_sun
from jaxsat.telemetry.raw_sun.settings import CleaningSettings


def read_telemetry(
    path: str | Path, satellite: SatelliteNumbers | None = None, *, cleaning: CleaningSettings | None = None
) -> Session:
    """Returns the session of a RAW_SUN file, cleaned; every row that is left out is in `rejections` with its reason.

    `satellite` says how much light its panels can see, Munin's where it is not given. Raises `InputError` with file,
    row and field where the file is none, or nothing usable is left of it.
    """
    return clean(read_raw_sun(Path(path)), cleaning, satellite)
