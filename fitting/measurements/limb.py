"""Limb angles as measurements of a fit: whitened residuals of distance and turn with their exact derivatives.

Penkov et al. 2009, section 2.1: the data of `tABlimb` beside the currents, under the weight `vesABlimb`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsat.math import quaternion, safe_norm
from jaxsat.sensors.limb import limb_distance, limb_turn, nadir_body


class LimbAngles(eqx.Module):
    """Limb angles at the samples of a problem."""

    measured: Float[Array | np.ndarray, "samples 2"]
    """Distance of body x from the limb and turn of the limb about it [rad]; zero where not measured."""
    known: Bool[Array | np.ndarray, "samples 2"]
    """Whether it was measured; False for padding."""
    sigma: Float[Array | np.ndarray, ""]
    """1-sigma of an angle on the sphere, its weight in the fit included [rad]."""
    earth_radius: Float[Array | np.ndarray, ""]
    """[m]"""


def limb_residual(
    q_inertial_from_body: Float[Array, "4"],
    position_eci: Float[Array, "3"],
    measured: Float[Array, "2"],
    earth_radius: Float[Array, ""],
) -> Float[Array, "2"]:
    """Modelled minus measured limb angles [rad], both as angles on the sphere.

    That of the turn, within half a turn, is multiplied by the sine of angle(x, nadir): a degree of turn moves the limb
    by less the nearer x is to the nadir, and where there is no turn left the residual is zero.
    """
    _, y, z = nadir_body(q_inertial_from_body, position_eci)
    off = limb_turn(q_inertial_from_body, position_eci) - measured[1]
    turn = safe_norm(jnp.stack([y, z])) * jnp.arctan2(jnp.sin(off), jnp.cos(off))
    return jnp.stack([limb_distance(q_inertial_from_body, position_eci, earth_radius) - measured[0], turn])


def limb_residuals(
    limb: LimbAngles,
    q: Float[Array, "samples 4"],
    position_eci: Float[Array, "samples 3"],
    measured: Float[Array, "samples 2"],
) -> tuple[Float[Array, "samples 2"], Float[Array, "samples 2 3"]]:
    """`limb_residual` at samples over sigma, and its derivative by a small rotation in body axes.

    `measured` are those of `limb.measured` that belong to the samples.
    """

    def at_sample(q, position, measured):
        def turned(rotation):
            both = quaternion.multiply(q, quaternion.from_rotation_vector(rotation))
            residual = limb_residual(both, position, measured, jnp.asarray(limb.earth_radius)) / limb.sigma
            return residual, residual

        by_rotation, residual = jax.jacfwd(turned, has_aux=True)(jnp.zeros(3, dtype=q.dtype))
        return residual, by_rotation

    return jax.vmap(at_sample)(q, position_eci, measured)
