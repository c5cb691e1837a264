"""Principal axes, in which satellites are moved where that spares work.

Half of the right-hand side is products with the inertia's off-diagonal elements.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsat.simulate.absent import DUST
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque


def common_axes(spacecraft: Spacecraft, torques: tuple[AbstractTorque, ...] | None) -> Float[np.ndarray, "3 3"] | None:
    """dcm_principal_from_body of a satellite, or of all where its leaves are over cases; None where it is of no use.

    So it is where the inertia is diagonal already or the cases have no axes in common, and where something cannot be
    turned: a torque with vectors of its own, or a part that is not known here.
    """
    inertia = np.asarray(spacecraft.inertia, float).reshape(-1, 3, 3)
    off_diagonal = np.abs(inertia * (1.0 - np.eye(3))).max()
    if spacecraft.parts or any(jnp.ndim(leaf) > 0 for leaf in jax.tree.leaves(torques)) or off_diagonal == 0.0:
        return None
    columns = np.linalg.eigh(inertia[0])[1]
    axes = columns.T * np.array([np.sign(np.linalg.det(columns)), 1.0, 1.0])[:, None]
    left = np.abs(axes @ inertia @ axes.T * (1.0 - np.eye(3))).max()
    return axes if left <= DUST * np.abs(inertia).max() else None
