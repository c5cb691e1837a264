"""Sun pointing with a pyramid sensor and thrusters (Zhukov 2019)."""

from jaxsat.control.sun_pointing.cases import Cases as Cases
from jaxsat.control.sun_pointing.cases import run_cases as run_cases
from jaxsat.control.sun_pointing.cases import run_one as run_one
from jaxsat.control.sun_pointing.draw import Dispersions as Dispersions
from jaxsat.control.sun_pointing.draw import draw_cases as draw_cases
from jaxsat.control.sun_pointing.law import SunPointingLaw as SunPointingLaw
from jaxsat.control.sun_pointing.sensing import LoopSettings as LoopSettings
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle as SunPointingVehicle
from jaxsat.control.sun_pointing.vehicle import nominal_vehicle as nominal_vehicle
