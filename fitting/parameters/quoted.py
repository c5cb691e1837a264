"""The names and units in which results quote a fit's numbers: the state, then every leaf, free or not."""

import jax
import jax.numpy as jnp
import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.parameters.free import FreeParameters
from fitting.parameters.names import STATE

STATE_UNITS = ("deg",) * 3 + ("deg/s",) * 3


def quoted_names(parameters: FreeParameters) -> tuple[str, ...]:
    """[state + leaves]"""
    return (*STATE, *(leaf.name for leaf in parameters.leaves))


def quoted_units(parameters: FreeParameters) -> tuple[str, ...]:
    """[state + leaves]"""
    return (*STATE_UNITS, *(leaf.unit for leaf in parameters.leaves))


def quoted_slopes(parameters: FreeParameters, values_jacobian: np.ndarray) -> np.ndarray:
    """[state + leaves, unknowns] change of each number, in its unit, for a unit of each unknown.

    `values_jacobian` [leaves unknowns] is that of the leaves, SI, by the unknowns after the state; attitudes are small
    turns about the body axes.
    """
    count = len(STATE)
    slopes = np.zeros((count + len(parameters.leaves), count + len(parameters.columns)))
    slopes[:count, :count] = np.degrees(np.diag([1.0] * 3 + [RATE_UNIT] * 3))
    to_unit = np.array([leaf.to_unit for leaf in parameters.leaves])
    slopes[count:, count:] = values_jacobian * to_unit[:, None]
    return slopes


def values_jacobian(parameters: FreeParameters, x: np.ndarray) -> np.ndarray:
    """[leaves unknowns] of the leaves, SI, by the unknowns after the state at `x` [unknowns]."""
    return np.asarray(jax.jacfwd(parameters.tree.values)(jnp.asarray(x[len(STATE) :])))
