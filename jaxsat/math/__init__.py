"""Quaternions, safe vector functions, sums of spherical harmonics."""

from jaxsat.math import quaternion as quaternion
from jaxsat.math.arrays import entries_at as entries_at
from jaxsat.math.arrays import float_array as float_array
from jaxsat.math.arrays import floating as floating
from jaxsat.math.arrays import is_known as is_known
from jaxsat.math.arrays import optional_array as optional_array
from jaxsat.math.arrays import optional_floating as optional_floating
from jaxsat.math.arrays import put as put
from jaxsat.math.arrays import with_entries as with_entries
from jaxsat.math.harmonics import gradient_coefficients as gradient_coefficients
from jaxsat.math.harmonics import harmonic_sums as harmonic_sums
from jaxsat.math.matrix import inverse_3x3 as inverse_3x3
from jaxsat.math.vector import angle_between as angle_between
from jaxsat.math.vector import cross as cross
from jaxsat.math.vector import safe_norm as safe_norm
from jaxsat.math.vector import unit as unit
