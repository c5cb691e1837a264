"""Satellite files read: those of a satellite with sensors of its own, and those of Munin's numbers."""

from collections.abc import Mapping
from pathlib import Path
from typing import overload

from jaxsat.errors import InputError
from jaxsat.files.toml_files import read_toml, validated, with_values
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.satellites.satellite import Satellite, describes_sensors, satellite_of


@overload
def read_satellite(path: None = None, *, changed: Mapping[str, object] | None = None) -> SatelliteNumbers: ...
@overload
def read_satellite(
    path: str | Path, *, changed: Mapping[str, object] | None = None
) -> Satellite | SatelliteNumbers: ...
def read_satellite(
    path: str | Path | None = None, *, changed: Mapping[str, object] | None = None
) -> Satellite | SatelliteNumbers:
    """Returns the satellite of a TOML file, or Munin.

    A file with `[body]` or `[sensors.NAME]` gives a `Satellite` with those sensors. One with the sections
    `[spacecraft]` and `[albedo]` changes Munin's numbers: what it leaves out is that of Munin. `changed` maps
    `section.key`, as `spacecraft.imax_mA`, to values in place of the file's. Raises `InputError` naming all wrong keys.
    """
    data = {} if path is None else read_toml(path, kind="TOML satellite")
    data = with_values(data, changed)
    if path is not None and describes_sensors(data):
        return satellite_of(data, Path(path))
    return validated(SatelliteNumbers, data, path)


def read_sensed(path: str | Path) -> Satellite:
    """Returns the satellite of a file that tells its sensors; raises `InputError` as `read_satellite`, or for none."""
    found = read_satellite(path)
    if not isinstance(found, Satellite):
        reason = "has no [sensors]; a table is read by those of its satellite file (`jaxsat init` prints a template)"
        raise InputError(reason, file=path)
    return found
