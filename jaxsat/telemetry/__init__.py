"""Telemetry files: units and frames are converted here and nowhere else."""

from jaxsat.telemetry.ccsds.aem import AttitudeEphemeris as AttitudeEphemeris
from jaxsat.telemetry.ccsds.aem import aem_text as aem_text
from jaxsat.telemetry.ccsds.aem import read_aem as read_aem
from jaxsat.telemetry.ccsds.oem import OrbitEphemeris as OrbitEphemeris
from jaxsat.telemetry.ccsds.oem import oem_text as oem_text
from jaxsat.telemetry.ccsds.oem import read_oem as read_oem
from jaxsat.telemetry.czml import czml_document as czml_document
from jaxsat.telemetry.elements.element_sets import ElementSet as ElementSet
from jaxsat.telemetry.elements.element_sets import nearest_element_set as nearest_element_set
from jaxsat.telemetry.elements.element_sets import read_element_sets as read_element_sets
from jaxsat.telemetry.limb_angles import LimbAngleFile as LimbAngleFile
from jaxsat.telemetry.limb_angles import MatchedLimbAngles as MatchedLimbAngles
from jaxsat.telemetry.limb_angles import match_limb_angles as match_limb_angles
from jaxsat.telemetry.limb_angles import read_limb_angles as read_limb_angles
from jaxsat.telemetry.raw_sun.cleaning import Rejection as Rejection
from jaxsat.telemetry.raw_sun.cleaning import Session as Session
from jaxsat.telemetry.raw_sun.cleaning import check_usable as check_usable
from jaxsat.telemetry.raw_sun.cleaning import clean as clean
from jaxsat.telemetry.raw_sun.reading import RawSunFile as RawSunFile
from jaxsat.telemetry.raw_sun.reading import read_raw_sun as read_raw_sun
from jaxsat.telemetry.raw_sun.settings import CleaningSettings as CleaningSettings
from jaxsat.telemetry.raw_sun.writing import raw_sun_text as raw_sun_text
from jaxsat.telemetry.readers import read_telemetry as read_telemetry
from jaxsat.telemetry.table.session import Channel as Channel
from jaxsat.telemetry.table.session import RejectedRow as RejectedRow
from jaxsat.telemetry.table.session import TableSession as TableSession
