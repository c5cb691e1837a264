"""Satellite files read: those of a satellite with sensors of its own, and those of Munin's numbers."""

from collections.abc import Mapping
from pathlib import Path

from jaxsat.files.toml_files import read_toml, validated, with_values
from jaxsat.satellites.described import described
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.satellites.satellite import Satellite, describes_sensors, satellite_of


def read_satellite(path: str | Path | None = None, *, changed: Mapping[str, object] | None = None) -> Satellite:
    """Returns the satellite of a TOML file, or Munin.

    A file with `[body]` or `[sensors.NAME]` gives a satellite with those sensors. One with the sections `[spacecraft]`
    and `[albedo]` changes Munin's numbers: what it leaves out is that of Munin. `changed` maps `section.key`, as
    `spacecraft.imax_mA`, to values in place of the file's. Raises `InputError` naming all wrong keys.
    """
    data = with_values({} if path is None else read_toml(path, kind="TOML satellite"), changed)
    if path is not None and describes_sensors(data):
        return satellite_of(data, Path(path))
    return described(validated(SatelliteNumbers, data, path))


def read_numbers(path: str | Path | None = None, *, changed: Mapping[str, object] | None = None) -> SatelliteNumbers:
    """Returns Munin's numbers, or those of a file with the sections `[spacecraft]` and `[albedo]`, as `read_satellite`.

    For what works on six panels, two rods and a magnet alone.
    """
    data = {} if path is None else read_toml(path, kind="TOML satellite")
    return validated(SatelliteNumbers, with_values(data, changed), path)
