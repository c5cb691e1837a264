"""Free-molecular drag on flat facets, its forces and its torque."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross
from jaxsat.spacecraft import Facets, Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment, required


def _drag_per_velocity(
    facets: Facets, air_velocity: Float[Array, "3"], air_density: Float[Array, ""]
) -> Float[Array, " facets"]:
    """C_D rho S max(0, n . v) / 2 of each facet [kg/s]: what multiplies -v."""
    windward = jnp.maximum(facets.normals @ air_velocity, 0.0)
    return 0.5 * facets.drag_coefficient * air_density * facets.areas * windward


def aerodynamic_forces(
    facets: Facets, air_velocity_body: Float[Array, "3"], air_density: Float[Array, ""]
) -> Float[Array, "facets 3"]:
    """Force of the air on each facet, body axes [N]; zero on facets that the flow meets from behind.

    F = -C_D rho/2 S |v| v max(0, cos theta), cos theta = n . v / |v|, v the velocity of the satellite against the air
    [m/s] (Wertz 1978, eq. 17-57; Markley & Crassidis 2014, sec. 3.3.6). Facets do not shade each other, and the thermal
    speed of the air is small against v.
    """
    drag = _drag_per_velocity(facets, air_velocity_body, air_density)
    return -drag[:, None] * air_velocity_body[None, :]


def aerodynamic_torque(
    facets: Facets, air_velocity_body: Float[Array, "3"], air_density: Float[Array, ""]
) -> Float[Array, "3"]:
    """Torque of `aerodynamic_forces` about the centre of mass, body axes [N m].

    All forces are parallel, so it is that of their sum at the centre of pressure: it turns that centre downstream.
    """
    drag = _drag_per_velocity(facets, air_velocity_body, air_density)
    return cross(air_velocity_body, drag @ facets.centers)


class AerodynamicTorque(AbstractTorque):
    """Drag on the satellite's facets, in the air of the orbit's table."""

    smooth: ClassVar[bool] = False

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        user, source = "AerodynamicTorque", "tabulate_orbit(..., atmosphere=ExponentialAtmosphere())"
        return aerodynamic_torque(
            required(spacecraft.facets, user, "Spacecraft.facets", "the satellite's surface, such as box_facets(size)"),
            required(around.air_velocity_body, user, "OrbitTable.air_velocity_eci", source),
            required(around.air_density, user, "OrbitTable.air_density", source),
        )
