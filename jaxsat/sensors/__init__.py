"""Sensors: what a satellite measures, noise apart."""

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
from jaxsat.sensors.sun_candidates import Candidates as Candidates
from jaxsat.sensors.sun_candidates import sun_candidates as sun_candidates
from jaxsat.sensors.sun_published import SunReading as SunReading
from jaxsat.sensors.sun_published import published_direction as published_direction
from jaxsat.sensors.sun_published import two_current_limit as two_current_limit
from jaxsat.sensors.sun_sensor import PyramidSunSensor as PyramidSunSensor
from jaxsat.sensors.sun_sensor import combine_detectors as combine_detectors
from jaxsat.sensors.sun_sensor import face_currents as face_currents
from jaxsat.sensors.sun_sensor import lit_fraction as lit_fraction
from jaxsat.sensors.sun_sensor import quantize as quantize
from jaxsat.sensors.sun_tracker import SunTrack as SunTrack
from jaxsat.sensors.sun_tracker import blank_track as blank_track
from jaxsat.sensors.sun_tracker import carried as carried
from jaxsat.sensors.sun_tracker import followed as followed
