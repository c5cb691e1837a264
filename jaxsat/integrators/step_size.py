"""The step that a motion needs."""

import math

import numpy as np

from jaxsat.math.runge_kutta import Tableau


def turn_error_coefficient(tableau: Tableau) -> float:
    """First coefficient in which the method's growth factor differs from the exponential: |b A^p 1 - 1/(p+1)!|."""
    a, b, order = tableau.matrix[:-1], tableau.matrix[-1], tableau.order
    return abs(b @ np.linalg.matrix_power(a, order) @ np.ones(tableau.stages) - 1.0 / math.factorial(order + 1))


def step_for(tableau: Tableau, rate: float, duration: float, tolerance: float) -> float:
    """Longest step [s] that keeps the attitude error of a turn at `rate` [rad/s] below `tolerance` [rad].

    A quaternion turning at a constant rate w obeys q' = (i w/2) q, of which each step of a method of order p misses
    C (w h/2)^(p+1) (`turn_error_coefficient`; 1/120 for RK4); over duration/h steps the angle error, twice the
    quaternion's, adds up to 2 C (w/2)^(p+1) h^p duration. Torques bend the motion and need shorter steps:
    `jaxsat.simulate.simulate` checks what comes out.
    """
    p = tableau.order
    return (tolerance / (2.0 * turn_error_coefficient(tableau) * duration * (0.5 * rate) ** (p + 1))) ** (1.0 / p)
