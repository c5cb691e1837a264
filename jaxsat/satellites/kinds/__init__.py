"""Kinds of sensors in a satellite file: the keys of each, and the sensor that they make.

A kind is a section with `built`; a new one is a file here, and a line in `KINDS`.
"""

from jaxsat.satellites.kinds.attitude import StarTrackerKeys
from jaxsat.satellites.kinds.common import SensorKeys
from jaxsat.satellites.kinds.earth import HorizonVectorKeys, LimbKeys
from jaxsat.satellites.kinds.field import GyroKeys, MagnetometerKeys
from jaxsat.satellites.kinds.light import PanelKeys, PhotodiodeKeys, SunElevationKeys
from jaxsat.satellites.kinds.sun import PyramidKeys, SunAngleKeys, SunVectorKeys

KINDS: dict[str, type[SensorKeys]] = {
    "magnetometer": MagnetometerKeys,
    "gyro": GyroKeys,
    "photodiodes": PhotodiodeKeys,
    "panels": PanelKeys,
    "sun_vector": SunVectorKeys,
    "sun_angles": SunAngleKeys,
    "sun_elevation": SunElevationKeys,
    "pyramid": PyramidKeys,
    "limb": LimbKeys,
    "horizon_vector": HorizonVectorKeys,
    "star_tracker": StarTrackerKeys,
}
