"""Pressure of sunlight on flat facets, its forces and its torque."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross
from jaxsat.spacecraft import Facets, Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment, required


def _along_light_and_normal(
    facets: Facets, sun_body: Float[Array, "3"], solar_pressure: Float[Array, ""]
) -> tuple[Float[Array, " facets"], Float[Array, " facets"]]:
    """Parts of the force of each facet against the Sun's direction and against its own normal [N]."""
    cosine = facets.normals @ sun_body
    light = solar_pressure * facets.areas * jnp.maximum(cosine, 0.0)
    return light * (1.0 - facets.specular), light * 2.0 * (facets.specular * cosine + facets.diffuse / 3.0)


def solar_pressure_forces(
    facets: Facets, sun_body: Float[Array, "3"], solar_pressure: Float[Array, ""]
) -> Float[Array, "facets 3"]:
    """Force of the sunlight on each facet, body axes [N]; zero on facets that the Sun does not see.

    F = -P S max(0, cos theta) [(1 - specular) s + 2 (specular cos theta + diffuse / 3) n], s the unit vector to the
    Sun, cos theta = n . s (Wertz 1978, sec. 17.2.2; Montenbruck & Gill 2000, sec. 3.4; Markley & Crassidis 2014,
    sec. 3.3.6). Facets do not shade each other; what they absorb they radiate evenly to all sides.
    """
    along_light, along_normal = _along_light_and_normal(facets, sun_body, solar_pressure)
    return -along_light[:, None] * sun_body[None, :] - along_normal[:, None] * facets.normals


def solar_pressure_torque(
    facets: Facets, sun_body: Float[Array, "3"], solar_pressure: Float[Array, ""]
) -> Float[Array, "3"]:
    """Torque of `solar_pressure_forces` about the centre of mass, body axes [N m]."""
    along_light, along_normal = _along_light_and_normal(facets, sun_body, solar_pressure)
    # The arms of the normal parts are the same at every step: c x n stands apart from what moves.
    return cross(sun_body, along_light @ facets.centers) - along_normal @ cross(facets.centers, facets.normals)


class SolarPressureTorque(AbstractTorque):
    """Pressure of the sunlight on the satellite's facets, eclipses as in the orbit's table."""

    smooth: ClassVar[bool] = False

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        user, source = "SolarPressureTorque", "tabulate_orbit(..., sun_eci=...)"
        return solar_pressure_torque(
            required(spacecraft.facets, user, "Spacecraft.facets", "the satellite's surface, such as box_facets(size)"),
            required(around.sun_body, user, "OrbitTable.sun_eci", source),
            required(around.solar_pressure, user, "OrbitTable.solar_pressure", source),
        )
