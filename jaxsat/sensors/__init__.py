"""Sensors: what a satellite measures, noise apart."""

from jaxsat.sensors.current_readings import current_readings as current_readings
from jaxsat.sensors.current_readings import limited_currents as limited_currents
from jaxsat.sensors.current_readings import uniform_noise as uniform_noise
from jaxsat.sensors.horizon_sensor import HorizonSensor as HorizonSensor
from jaxsat.sensors.horizon_sensor import band_harmonics as band_harmonics
from jaxsat.sensors.horizon_sensor import chord_of_disk as chord_of_disk
from jaxsat.sensors.horizon_sensor import normalised_output as normalised_output
from jaxsat.sensors.horizon_sensor import present as present
from jaxsat.sensors.horizon_sensor import ramp_harmonics as ramp_harmonics
from jaxsat.sensors.horizon_sensor import scan_harmonics as scan_harmonics
from jaxsat.sensors.horizon_sensor import step_harmonics as step_harmonics
from jaxsat.sensors.limb import limb_distance as limb_distance
from jaxsat.sensors.limb import limb_turn as limb_turn
from jaxsat.sensors.limb import nadir_body as nadir_body
from jaxsat.sensors.polygon_panels import PolygonPanels as PolygonPanels
from jaxsat.sensors.polygon_panels import mirror_currents as mirror_currents
from jaxsat.sensors.polygon_panels import polygon_panels as polygon_panels
from jaxsat.sensors.solar_panels import Albedo as Albedo
from jaxsat.sensors.solar_panels import albedo_currents as albedo_currents
from jaxsat.sensors.solar_panels import direct_currents as direct_currents
from jaxsat.sensors.solar_panels import panel_currents as panel_currents
from jaxsat.sensors.sun_sensor import PyramidSunSensor as PyramidSunSensor
from jaxsat.sensors.sun_sensor import combine_detectors as combine_detectors
from jaxsat.sensors.sun_sensor import face_currents as face_currents
from jaxsat.sensors.sun_sensor import lit_fraction as lit_fraction
from jaxsat.sensors.sun_sensor import quantize as quantize
