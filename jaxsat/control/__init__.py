"""Control: laws and actuators that any loop may use, and the run of closed loops; a folder for each study."""

from jaxsat.control.actuators import Pulses as Pulses
from jaxsat.control.actuators import Thrusters as Thrusters
from jaxsat.control.actuators import fire as fire
from jaxsat.control.attitude_error import modified_rodrigues as modified_rodrigues
from jaxsat.control.attitude_error import rate_command as rate_command
from jaxsat.control.closed_loop import ClosedLoop as ClosedLoop
from jaxsat.control.closed_loop import normals as normals
from jaxsat.control.closed_loop import run_cases as run_cases
from jaxsat.control.closed_loop import run_one as run_one
from jaxsat.control.magnetic_actuator import actuator_dipole as actuator_dipole
from jaxsat.control.magnetic_actuator import saturated as saturated
