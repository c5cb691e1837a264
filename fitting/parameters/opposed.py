"""A dipole against that of the satellite file, of which the direction alone is fitted.

There the components move and their size is held: on the way to the opposite they pass through none at all, where no
step knows its direction. So the fit is made once more about the opposite dipole.
"""

import numpy as np

from fitting.parameters.free import FreeParameters
from jaxsat.satellites.model import MAGNET_PLACE

OPPOSED = "the dipole points against that of the satellite file: look at its sign there"
"""What is told of it."""


def direction_alone(parameters: FreeParameters) -> bool:
    """Whether the components of the dipole move and its size is held."""
    return "magnet" in parameters.gauged and float(np.asarray(parameters.tree.by_angles)) == 0.0


def is_opposed(parameters: FreeParameters, x_model: np.ndarray) -> bool:
    """Whether the dipole of unknowns after the state, its size held, points away from the nominal one."""
    if not direction_alone(parameters):
        return False
    index, nominal = _components(parameters), np.asarray(parameters.tree.nominal)
    # Before its size is restored, which leaves the direction; a few of JAX's operations would take half a second here.
    found = nominal[index] + np.asarray(parameters.tree.tangent)[index] @ x_model
    return bool(found @ nominal[index] < 0.0)


def turned_round(parameters: FreeParameters) -> FreeParameters:
    """The same about the opposite dipole."""
    nominal = np.asarray(parameters.tree.nominal)
    return parameters.with_nominal({k: -float(nominal[k]) for k in _components(parameters)})


def _components(parameters: FreeParameters) -> list[int]:
    """Numbers of the leaves of the dipole's vector."""
    return [k for k, leaf in enumerate(parameters.leaves) if leaf.place == MAGNET_PLACE]
