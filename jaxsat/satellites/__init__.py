"""Satellite files: a satellite with any sensors in TOML, and Munin's numbers, which stand in `munin.toml`."""

from jaxsat.satellites.numbers import SatelliteNumbers as SatelliteNumbers
from jaxsat.satellites.reading import read_numbers as read_numbers
from jaxsat.satellites.reading import read_satellite as read_satellite
from jaxsat.satellites.satellite import Satellite as Satellite
