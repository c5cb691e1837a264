"""Everything that does not depend on attitude, evaluated once at the integrator's nodes."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.environment.diffuse import DiffuseAlbedo
from jaxsat.environment.magnetic import InternalField, magnetic_field_eci
from jaxsat.environment.orbit import KeplerOrbit
from jaxsat.environment.shadow import ConeShadow, CylinderShadow
from jaxsat.environment.specular import SpecularAlbedo


class OrbitTable(eqx.Module):
    """Position and magnetic field along an orbit: what torques and the magnetometer read."""

    position_eci: Float[Array, "*times 3"]
    """Position, inertial frame [m]."""
    b_field_eci: Float[Array, "*times 3"]
    """Magnetic field, inertial components [T]."""


class LightTable(eqx.Module):
    """Sunlight and earthlight along an orbit: what panels and Sun sensors read."""

    sun_eci: Float[Array, "*times 3"]
    """Unit vector to the Sun, inertial frame."""
    illumination: Float[Array, "*times"]
    """Visible fraction of the Sun, 0 to 1."""
    specular_direction_eci: Float[Array, "*times 3"]
    """Unit vector from the satellite to the mirror image of the Sun in the Earth."""
    specular_factor: Float[Array, "*times"]
    """Mirrored beam over direct sunlight, for a perfect mirror."""
    diffuse_direction_eci: Float[Array, "*times k 3"]
    """Unit vectors from the satellite to patches of the Earth."""
    diffuse_weight: Float[Array, "*times k"]
    """Current of a panel facing the patch over that of direct sunlight, for reflectivity one."""


def tabulate_orbit(
    orbit: KeplerOrbit,
    times: Float[Array, "n"],
    field: InternalField,
    greenwich_angle_0: float | Float[Array, ""],
    earth_rotation_rate: float | Float[Array, ""] = EARTH_ROTATION_RATE,
) -> OrbitTable:
    """Return position and field at `times` [s]; the Greenwich angle [rad] is `greenwich_angle_0` at t = 0."""

    def at(t):
        position_eci, _ = orbit(t)
        greenwich_angle = greenwich_angle_0 + earth_rotation_rate * t
        return OrbitTable(position_eci, magnetic_field_eci(field, position_eci, greenwich_angle))

    return jax.vmap(at)(times)


def tabulate_light(
    orbit: KeplerOrbit,
    times: Float[Array, "n"],
    sun_eci: Float[Array, "*times 3"],
    *,
    shadow: CylinderShadow | ConeShadow | None = None,
    specular: SpecularAlbedo | None = None,
    diffuse: DiffuseAlbedo | None = None,
) -> LightTable:
    """Return illumination and albedo geometry at `times` [s] for unit vectors to the Sun at the same times.

    By default a sharp cylindrical shadow and both albedos on a sphere of the mean radius of the Earth.
    """
    shadow, specular, diffuse = shadow or CylinderShadow(), specular or SpecularAlbedo(), diffuse or DiffuseAlbedo()

    def at(t, sun):
        position_eci, _ = orbit(t)
        return LightTable(sun, shadow(position_eci, sun), *specular(position_eci, sun), *diffuse(position_eci, sun))

    return jax.vmap(at)(times, jnp.asarray(sun_eci))
