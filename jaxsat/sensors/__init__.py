"""Sensors: what a satellite measures, noise apart."""

from jaxsat.sensors.limb import limb_distance as limb_distance
from jaxsat.sensors.limb import limb_turn as limb_turn
from jaxsat.sensors.limb import nadir_body as nadir_body
from jaxsat.sensors.solar_panels import Albedo as Albedo
from jaxsat.sensors.solar_panels import albedo_currents as albedo_currents
from jaxsat.sensors.solar_panels import direct_currents as direct_currents
from jaxsat.sensors.solar_panels import panel_currents as panel_currents
