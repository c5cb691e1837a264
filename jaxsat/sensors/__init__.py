"""Sensors: what a satellite measures, noise apart."""

from jaxsat.sensors.solar_panels import Albedo as Albedo
from jaxsat.sensors.solar_panels import albedo_currents as albedo_currents
from jaxsat.sensors.solar_panels import direct_currents as direct_currents
from jaxsat.sensors.solar_panels import panel_currents as panel_currents
