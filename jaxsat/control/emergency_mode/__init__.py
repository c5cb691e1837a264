"""Emergency mode with three magnetic coils (Somov 2018): into the orbital attitude, and years of swinging there."""

from jaxsat.control.emergency_mode.cases import Cases as Cases
from jaxsat.control.emergency_mode.cases import run_cases as run_cases
from jaxsat.control.emergency_mode.cases import run_leg as run_leg
from jaxsat.control.emergency_mode.cases import run_one as run_one
from jaxsat.control.emergency_mode.draw import Dispersions as Dispersions
from jaxsat.control.emergency_mode.draw import draw_cases as draw_cases
from jaxsat.control.emergency_mode.law import EmergencyLaw as EmergencyLaw
from jaxsat.control.emergency_mode.loop import LoopState as LoopState
from jaxsat.control.emergency_mode.loop import Sample as Sample
from jaxsat.control.emergency_mode.loop import Supervisor as Supervisor
from jaxsat.control.emergency_mode.orbit import Flight as Flight
from jaxsat.control.emergency_mode.orbit import Leg as Leg
from jaxsat.control.emergency_mode.orbit import fly as fly
from jaxsat.control.emergency_mode.orbit import leg as leg
from jaxsat.control.emergency_mode.start import transition_start as transition_start
from jaxsat.control.emergency_mode.vehicle import EmergencyVehicle as EmergencyVehicle
from jaxsat.control.emergency_mode.vehicle import nominal_vehicle as nominal_vehicle
from jaxsat.control.emergency_mode.years import run_years as run_years
