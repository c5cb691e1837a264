"""Telemetry files: units and frames are converted here and nowhere else."""

from jaxsat.telemetry.aem import AttitudeEphemeris as AttitudeEphemeris
from jaxsat.telemetry.aem import aem_text as aem_text
from jaxsat.telemetry.aem import read_aem as read_aem
from jaxsat.telemetry.cleaning import CleaningSettings as CleaningSettings
from jaxsat.telemetry.cleaning import Rejection as Rejection
from jaxsat.telemetry.cleaning import Session as Session
from jaxsat.telemetry.cleaning import check_usable as check_usable
from jaxsat.telemetry.cleaning import clean as clean
from jaxsat.telemetry.czml import czml_document as czml_document
from jaxsat.telemetry.element_sets import ElementSet as ElementSet
from jaxsat.telemetry.element_sets import nearest_element_set as nearest_element_set
from jaxsat.telemetry.element_sets import read_element_sets as read_element_sets
from jaxsat.telemetry.limb_angles import LimbAngleFile as LimbAngleFile
from jaxsat.telemetry.limb_angles import MatchedLimbAngles as MatchedLimbAngles
from jaxsat.telemetry.limb_angles import match_limb_angles as match_limb_angles
from jaxsat.telemetry.limb_angles import read_limb_angles as read_limb_angles
from jaxsat.telemetry.oem import OrbitEphemeris as OrbitEphemeris
from jaxsat.telemetry.oem import oem_text as oem_text
from jaxsat.telemetry.oem import read_oem as read_oem
from jaxsat.telemetry.raw_sun import RawSunFile as RawSunFile
from jaxsat.telemetry.raw_sun import read_raw_sun as read_raw_sun
from jaxsat.telemetry.raw_sun_text import raw_sun_text as raw_sun_text
from jaxsat.telemetry.turning import attitude_between as attitude_between
