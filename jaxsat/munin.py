"""Munin's satellite from its numbers: a box with a magnet, two linear rods and six panels (Penkov et al. 2009)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals, symmetric_tensor, tilted


def munin_panels(max_current: Float[Array, ""], gains: Float[Array, "6"], tilts: Float[Array, "6 2"]) -> SolarPanels:
    """Its panels, in the order of `PANEL_NAMES`: currents [A], and turns off the box's faces on `TILT_AXES` [rad]."""
    return SolarPanels(tilted(box_normals(), tilts), max_current, gains)


def munin_satellite(
    inertia: Float[Array, "6"],
    magnet: Float[Array, "3"],
    rods: Float[Array, "2"],
    *,
    reference_field: Float[Array, ""],
    panels: SolarPanels,
) -> Spacecraft:
    """The satellite, SI: inertia (xx, yy, zz, xy, xz, yz), moments of the y and z rods in the reference field [T]."""
    along_y_and_z = jnp.eye(3, dtype=rods.dtype)[1:]
    return Spacecraft(symmetric_tensor(inertia), magnet, MagneticRods(rods, along_y_and_z, reference_field), panels)
