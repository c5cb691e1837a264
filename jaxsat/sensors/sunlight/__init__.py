"""Sensors that read the Sun: cells of any law, panels, Sun sensors."""

from jaxsat.sensors.sunlight.panels import Panels as Panels
from jaxsat.sensors.sunlight.photodiodes import Photodiodes as Photodiodes
from jaxsat.sensors.sunlight.pyramid import PyramidSensor as PyramidSensor
from jaxsat.sensors.sunlight.sun_direction import SunAngles as SunAngles
from jaxsat.sensors.sunlight.sun_direction import SunVector as SunVector
from jaxsat.sensors.sunlight.sun_elevation import SunElevation as SunElevation
