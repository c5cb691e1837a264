"""What belongs to the satellite and may be fitted: mass properties and parts such as magnet, rods, panels, surface.

Every number is a leaf.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import float_array, floating, optional_floating, quaternion
from jaxsat.panel_names import TILT_AXES

Real = int | float


def box_normals() -> Float[Array, "6 3"]:
    """Outward normals of a box's faces in body axes, in the order of `PANEL_NAMES`."""
    return jnp.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0], [0, 0, 1.0], [0, 0, -1.0]])


def tilted(normals: Float[Array, "6 3"], angles: Float[Array, "6 2"]) -> Float[Array, "6 3"]:
    """Normals of a box's panels, each turned by the rotation vector with its two `angles` [rad] on its `TILT_AXES`."""
    axes = np.array([[np.eye(3)["xyz".index(name)] for name in pair] for pair in TILT_AXES])
    turns = quaternion.from_rotation_vector(jnp.einsum("pk,pkc->pc", angles, axes.astype(angles.dtype)))
    return jax.vmap(quaternion.rotate)(turns, normals)


class MagneticRods(eqx.Module):
    """Rods of soft magnetic material, magnetised in proportion to the field along them.

    The moment of rod k is `moments[k] (B . axes[k]) / reference_field` (Penkov et al. 2009, sec. 4, with the
    normalisation of the field made explicit). Valid far from saturation; no hysteresis.
    """

    moments: Float[Array, " rods"] = eqx.field(converter=floating)
    """Moment of each rod in the reference field along it [A m^2]."""
    axes: Float[Array, "rods 3"] = eqx.field(converter=floating)
    """Unit vectors along the rods, body axes."""
    reference_field: Float[Array, ""] = eqx.field(converter=floating)
    """Field at which `moments` is quoted [T]."""

    def dipole(self, b_field_body: Float[Array, "3"]) -> Float[Array, "3"]:
        """Sum of the rods' moments in a field, body axes [A m^2]."""
        return (self.moments * (self.axes @ b_field_body) / self.reference_field) @ self.axes


class SolarPanels(eqx.Module):
    """Flat body-mounted panels."""

    normals: Float[Array, "panels 3"] = eqx.field(converter=floating)
    """Outward unit normals, body axes."""
    max_current: Float[Array, ""] = eqx.field(converter=floating)
    """Current of the reference panel facing the Sun [A]."""
    gains: Float[Array, " panels"] = eqx.field(converter=floating)
    """Current of each panel over that of the reference panel, at equal light."""


class HysteresisRods(eqx.Module):
    """Rods of soft magnetic material with hysteresis; the law is that of `jaxsat.torques.hysteresis`.

    Coercive field, remanence and saturation are the apparent ones of the rod in the field outside it: its own
    demagnetising field is in them, so they depend on its shape as well as on its material (Gerhardt & Palo 2010).
    For slender rods they are of the order of 12 A/m, 0.004 T and 0.025 T.
    """

    axes: Float[Array, "rods 3"] = eqx.field(converter=float_array)
    """Unit vectors along the rods, body axes."""
    volumes: Float[Array, " rods"] = eqx.field(converter=float_array)
    """[m^3]."""
    coercive_field: Float[Array, " rods"] = eqx.field(converter=float_array)
    """Field at which the saturated rod loses its induction, Hc [A/m]."""
    remanence: Float[Array, " rods"] = eqx.field(converter=float_array)
    """Induction left by saturation without a field, Br < Bs [T]."""
    saturation: Float[Array, " rods"] = eqx.field(converter=float_array)
    """Induction in a strong field, Bs [T]."""
    initial_slope: Float[Array, ""] = eqx.field(converter=float_array, default=0.0)
    """Slope after the field turns over that of the boundary loop, q0, in 0..1."""
    exponent: Float[Array, ""] = eqx.field(converter=float_array, default=2.0)
    """How late minor loops join the boundary, p >= 1."""
    induction: Float[Array, "..."] = eqx.field(converter=float_array, default=0.0)
    """With which the rods begin a motion that is fitted, one for all or for each [T]."""


class Facets(eqx.Module):
    """Flat pieces of the satellite's outer surface, for the pressure of air and of sunlight."""

    areas: Float[Array, " facets"] = eqx.field(converter=float_array)
    """[m^2]."""
    centers: Float[Array, "facets 3"] = eqx.field(converter=float_array)
    """Centroids from the centre of mass, body axes [m]."""
    normals: Float[Array, "facets 3"] = eqx.field(converter=float_array)
    """Outward unit normals, body axes."""
    specular: Float[Array, " facets"] = eqx.field(converter=float_array)
    """Share of sunlight reflected as by a mirror."""
    diffuse: Float[Array, " facets"] = eqx.field(converter=float_array)
    """Share of sunlight scattered by Lambert's law; the rest is absorbed."""
    drag_coefficient: Float[Array, ""] = eqx.field(converter=float_array, default=2.2)
    """C_D of a facet across the flow."""


def box_facets(
    size: Sequence[Real] | Float[Array, "3"],
    *,
    center_of_mass: Sequence[Real] | Float[Array, "3"] = (0.0, 0.0, 0.0),
    specular: Real | Float[Array, ""] = 0.0,
    diffuse: Real | Float[Array, ""] = 0.0,
    drag_coefficient: Real | Float[Array, ""] = 2.2,
) -> Facets:
    """Faces of a box with edges `size` [m] along the body axes, in the order of `PANEL_NAMES`.

    `center_of_mass` is counted from the middle of the box [m]; all faces reflect alike.
    """
    edges, center, normals = jnp.asarray(size, float), jnp.asarray(center_of_mass, float), box_normals()
    return Facets(
        areas=edges[np.array([1, 1, 2, 2, 0, 0])] * edges[np.array([2, 2, 0, 0, 1, 1])],
        centers=0.5 * normals * edges[None, :] - center[None, :],
        normals=normals,
        specular=jnp.broadcast_to(float_array(specular), (6,)),
        diffuse=jnp.broadcast_to(float_array(diffuse), (6,)),
        drag_coefficient=float_array(drag_coefficient),
    )


class Spacecraft(eqx.Module):
    """A rigid satellite and its parts, of which it may have any; what is None costs nothing.

    `jaxsat.torques.torques_of` says which torques follow from the parts that are there.
    """

    inertia: Float[Array, "3 3"] = eqx.field(converter=floating)
    """Inertia tensor about the centre of mass, body axes [kg m^2]."""
    magnet: Float[Array, "3"] | None = eqx.field(converter=optional_floating, default=None)
    """Permanent dipole, body axes [A m^2]."""
    rods: MagneticRods | None = None
    """Rods without hysteresis."""
    panels: SolarPanels | None = None
    hysteresis_rods: HysteresisRods | None = None
    facets: Facets | None = None
    """Outer surface, for drag and solar pressure."""
    parts: tuple[eqx.Module, ...] = ()
    """Further parts that know their torque: `jaxsat.torques.AbstractTorque`s with the numbers of the part as leaves."""


def in_axes(spacecraft: Spacecraft, dcm_new_from_body: Float[Array | np.ndarray, "3 3"]) -> Spacecraft:
    """The same satellite described in other axes; ValueError where it has `parts`, whose vectors nobody knows here."""
    if spacecraft.parts:
        raise ValueError("in_axes: Spacecraft.parts cannot be described in other axes: give a satellite without them")
    dcm = jnp.asarray(dcm_new_from_body)

    def vectors(craft):
        found = [
            craft.magnet,
            None if craft.rods is None else craft.rods.axes,
            None if craft.panels is None else craft.panels.normals,
            None if craft.hysteresis_rods is None else craft.hysteresis_rods.axes,
            *([] if craft.facets is None else [craft.facets.centers, craft.facets.normals]),
        ]
        return [v for v in found if v is not None]

    new = eqx.tree_at(vectors, spacecraft, [v @ dcm.T for v in vectors(spacecraft)])
    return eqx.tree_at(lambda craft: craft.inertia, new, dcm @ spacecraft.inertia @ dcm.T)


def symmetric_tensor(components: Float[Array, "6"]) -> Float[Array, "3 3"]:
    """Tensor from (xx, yy, zz, xy, xz, yz); xy is the tensor's entry J12 itself, not the product of inertia -J12."""
    xx, yy, zz, xy, xz, yz = (components[k] for k in range(6))
    return jnp.stack([jnp.stack([xx, xy, xz]), jnp.stack([xy, yy, yz]), jnp.stack([xz, yz, zz])])
