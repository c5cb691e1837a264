"""Quaternions and safe vector functions."""

from jaxsat.math import quaternion as quaternion
from jaxsat.math.arrays import float_array as float_array
from jaxsat.math.matrix import inverse_3x3 as inverse_3x3
from jaxsat.math.vector import angle_between as angle_between
from jaxsat.math.vector import cross as cross
from jaxsat.math.vector import safe_norm as safe_norm
from jaxsat.math.vector import unit as unit
