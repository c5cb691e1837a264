"""What numbers can be of a satellite and which cannot, in NumPy: for settings, files and the simulator alike."""

from jaxsat.physical.attitude import is_attitude as is_attitude
from jaxsat.physical.attitude import unit_quaternion as unit_quaternion
from jaxsat.physical.inertia import check_inertia as check_inertia
from jaxsat.physical.inertia import is_of_a_body as is_of_a_body
