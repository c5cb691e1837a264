"""Currents of body-mounted solar panels: direct sunlight, specular and diffuse light of the Earth.

Each function takes one attitude and one entry of a `LightTable`; batch with `jax.vmap`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.environment import LightTable
from jaxsat.math import quaternion
from jaxsat.spacecraft import SolarPanels

LANES = 8
"""Patches of the Earth that are looked at together: as many numbers as a register holds."""


class Albedo(eqx.Module):
    """Reflectivity of the Earth in the two simplest laws of reflection."""

    specular: Float[Array, ""]
    """Share of the light reflected by a mirror-like sphere."""
    diffuse: Float[Array, ""]
    """Share of the light scattered by a Lambert sphere."""


def direct_currents(
    q_inertial_from_body: Float[Array, "4"], panels: SolarPanels, light: LightTable
) -> Float[Array, " panels"]:
    """Currents from the Sun's own light: I_max g max(0, n . s) times the visible share of the disk [A]."""
    sun_body = quaternion.rotate_inverse(q_inertial_from_body, light.sun_eci)
    return panels.max_current * panels.gains * light.illumination * jnp.maximum(panels.normals @ sun_body, 0.0)


def albedo_currents(
    q_inertial_from_body: Float[Array, "4"], panels: SolarPanels, albedo: Albedo, light: LightTable
) -> Float[Array, " panels"]:
    """Currents from light that the Earth returns [A] (Penkov et al. 2009, sec. 3.5; Lambert 1760 for the diffuse part).

    The light of the mirror image comes from one direction, the scattered light from a sum over patches; each counts
    only on panels that it meets from the front.
    """
    # One small rotation of the normals instead of one for each patch.
    normals_eci = panels.normals @ quaternion.to_dcm(q_inertial_from_body).T
    return panels.max_current * panels.gains * earthlight(normals_eci, albedo, light)


def earthlight(normals_eci: Float[Array, "faces 3"], albedo: Albedo, light: LightTable) -> Float[Array, " faces"]:
    """Light of the Earth on faces with these normals, over that of the Sun square on a face."""
    specular = light.specular_factor * jnp.maximum(normals_eci @ light.specular_direction_eci, 0.0)
    diffuse = jnp.sum(normals_eci * _visible_flux(normals_eci, light), axis=-1)
    return albedo.specular * specular + albedo.diffuse * diffuse


def _visible_flux(normals_eci: Float[Array, "panels 3"], light: LightTable) -> Float[Array, "panels 3"]:
    """Sum of weight times direction over the patches in front of each panel; n . flux is the sum of max(0, n . d).

    It is constant between the instants when a patch crosses a panel's horizon, where its contribution is zero, so it
    is the exact gradient with respect to n, and no derivative by n passes through the sum over patches.
    """
    normals = jax.lax.stop_gradient(normals_eci)
    short = -light.diffuse_weight.shape[0] % LANES
    directions = jnp.pad(light.diffuse_direction_eci, ((0, short), (0, 0))).reshape(-1, LANES, 3).swapaxes(1, 2)
    weights = jnp.pad(light.diffuse_weight, (0, short)).reshape(-1, LANES)

    def add(flux, patches):
        directions, weights = patches
        height = sum(normals[:, k, None] * directions[None, k] for k in range(3))
        return flux + jnp.where(height > 0.0, weights[None], 0.0)[:, None, :] * directions[None], None

    # Patches side by side in a register; a product with a matrix waits for one after the other, ten times as long.
    blank = jnp.zeros((*normals.shape, LANES), directions.dtype)
    return jnp.sum(jax.lax.scan(add, blank, (directions, weights))[0], axis=-1)


def panel_currents(
    q_inertial_from_body: Float[Array, "4"], panels: SolarPanels, albedo: Albedo, light: LightTable
) -> Float[Array, " panels"]:
    """Noise-free currents of all panels [A]; exactly zero where a panel sees neither the Sun nor the lit Earth."""
    return direct_currents(q_inertial_from_body, panels, light) + albedo_currents(
        q_inertial_from_body, panels, albedo, light
    )
