"""Control laws that any loop may use, as functions of arrays: damping, pointing, dumping; and attitudes to point to."""

from jaxsat.control.laws.b_dot import damping_dipole as damping_dipole
from jaxsat.control.laws.b_dot import damping_gain as damping_gain
from jaxsat.control.laws.momentum import across_field_dipole as across_field_dipole
from jaxsat.control.laws.momentum import dumping_dipole as dumping_dipole
from jaxsat.control.laws.quaternion_pd import attitude_error as attitude_error
from jaxsat.control.laws.quaternion_pd import pointing_torque as pointing_torque
from jaxsat.control.laws.targets import Target as Target
from jaxsat.control.laws.targets import target_along as target_along
