"""Satellite files: which numbers a satellite has, in TOML; Munin's stand in `munin.toml`."""

from jaxsat.satellites.numbers import SatelliteNumbers as SatelliteNumbers
from jaxsat.satellites.numbers import read_satellite as read_satellite
