"""Control: attitude error, thrusters, Sun pointing."""

from jaxsat.control.attitude_error import modified_rodrigues as modified_rodrigues
from jaxsat.control.attitude_error import rate_command as rate_command
from jaxsat.control.sun_pointing.cases import Cases as Cases
from jaxsat.control.sun_pointing.cases import run_cases as run_cases
from jaxsat.control.sun_pointing.cases import run_one as run_one
from jaxsat.control.sun_pointing.draw import Dispersions as Dispersions
from jaxsat.control.sun_pointing.draw import draw_cases as draw_cases
from jaxsat.control.sun_pointing.law import SunPointingLaw as SunPointingLaw
from jaxsat.control.sun_pointing.loop import LoopSettings as LoopSettings
from jaxsat.control.sun_pointing.loop import LoopState as LoopState
from jaxsat.control.sun_pointing.sensitivity import Sensitivity as Sensitivity
from jaxsat.control.sun_pointing.sensitivity import sensitivities as sensitivities
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle as SunPointingVehicle
from jaxsat.control.sun_pointing.vehicle import nominal_vehicle as nominal_vehicle
from jaxsat.control.thrusters import Thrusters as Thrusters
from jaxsat.control.thrusters import fire as fire
