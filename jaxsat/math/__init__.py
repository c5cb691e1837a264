"""Quaternions and safe vector functions."""

from jaxsat.math import quaternion as quaternion
from jaxsat.math.matrix import inverse_3x3 as inverse_3x3
from jaxsat.math.safe import angle_between as angle_between
from jaxsat.math.safe import safe_norm as safe_norm
from jaxsat.math.safe import unit as unit
