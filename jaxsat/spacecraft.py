"""What belongs to the satellite and may be fitted: mass properties, magnet, rods, panels. Every number is a leaf."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

PANEL_NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Natural order of the panels of a box, and of the rows of `box_normals()`."""


def box_normals() -> Float[Array, "6 3"]:
    """Outward normals of a box's faces in body axes, in the order of `PANEL_NAMES`."""
    return jnp.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0], [0, 0, 1.0], [0, 0, -1.0]])


class MagneticRods(eqx.Module):
    """Rods of soft magnetic material, magnetised in proportion to the field along them.

    The moment of rod k is `moments[k] (B . axes[k]) / reference_field` (Penkov et al. 2009, sec. 4, with the
    normalisation of the field made explicit). Valid far from saturation; no hysteresis.
    """

    moments: Float[Array, " rods"]
    """Moment of each rod in the reference field along it [A m^2]."""
    axes: Float[Array, "rods 3"]
    """Unit vectors along the rods, body axes."""
    reference_field: Float[Array, ""]
    """Field at which `moments` is quoted [T]."""

    def dipole(self, b_field_body: Float[Array, "3"]) -> Float[Array, "3"]:
        """Sum of the rods' moments in a field, body axes [A m^2]."""
        return (self.moments * (self.axes @ b_field_body) / self.reference_field) @ self.axes


class SolarPanels(eqx.Module):
    """Flat body-mounted panels."""

    normals: Float[Array, "panels 3"]
    """Outward unit normals, body axes."""
    max_current: Float[Array, ""]
    """Current of the reference panel facing the Sun [A]."""
    gains: Float[Array, " panels"]
    """Current of each panel over that of the reference panel, at equal light."""


class Spacecraft(eqx.Module):
    """A rigid satellite with a magnet, rods and panels."""

    inertia: Float[Array, "3 3"]
    """Inertia tensor about the centre of mass, body axes [kg m^2]."""
    magnet: Float[Array, "3"]
    """Permanent dipole, body axes [A m^2]."""
    rods: MagneticRods
    panels: SolarPanels


def symmetric_tensor(components: Float[Array, "6"]) -> Float[Array, "3 3"]:
    """Tensor from (xx, yy, zz, xy, xz, yz); xy is the tensor's entry J12 itself, not the product of inertia -J12."""
    xx, yy, zz, xy, xz, yz = (components[k] for k in range(6))
    return jnp.stack([jnp.stack([xx, xy, xz]), jnp.stack([xy, yy, yz]), jnp.stack([xz, yz, zz])])
