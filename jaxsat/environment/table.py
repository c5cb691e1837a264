"""Everything that does not depend on attitude, evaluated once at the integrator's nodes."""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import AU, EARTH_ROTATION_RATE, SOLAR_PRESSURE
from jaxsat.environment.albedo.diffuse import DiffuseAlbedo
from jaxsat.environment.albedo.specular import SpecularAlbedo
from jaxsat.environment.atmosphere import ExponentialAtmosphere, air_velocity_eci
from jaxsat.environment.commands import CommandTable
from jaxsat.environment.magnetic import AbstractMagneticField, magnetic_field_eci
from jaxsat.environment.shadow import ConeShadow, CylinderShadow

Orbit = Callable[[Float[Array, ""]], tuple[Float[Array, "3"], Float[Array, "3"]]]
"""Position [m] and velocity [m/s], inertial frame, of a time [s]."""


class OrbitTable(eqx.Module):
    """What the torques and the magnetometer read along an orbit; entries that no torque asked for stay None."""

    position_eci: Float[Array, "*times 3"]
    """Position, inertial frame [m]."""
    b_field_eci: Float[Array, "*times 3"]
    """Magnetic field, inertial components [T]."""
    b_rate_eci: Float[Array, "*times 3"] | None = None
    """Rate of the inertial components of the field along the orbit [T/s]."""
    air_velocity_eci: Float[Array, "*times 3"] | None = None
    """Velocity of the satellite against air that turns with the Earth, inertial components [m/s]."""
    air_density: Float[Array, "*times"] | None = None
    """[kg/m^3]."""
    sun_eci: Float[Array, "*times 3"] | None = None
    """Unit vector to the Sun, inertial frame."""
    solar_pressure: Float[Array, "*times"] | None = None
    """Pressure of the sunlight on a black surface facing it, eclipse included [Pa]."""
    commands: CommandTable | None = None
    """What coils and wheels were commanded."""
    time: Float[Array, "*times"] | None = None
    """The times themselves [s], for torques that follow a schedule."""

    def at_end(self) -> "OrbitTable":
        """As a step that ends here meets it: what is commanded from now on is not yet."""
        then = self.commands
        if then is None:
            return self
        ended = dataclasses.replace(then, values=then.values_before, rates=then.rates_before)
        return dataclasses.replace(self, commands=ended)


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
    """Current of a panel facing the patch over that of direct sunlight, for reflectivity one or the zonal one."""


def tabulate_orbit(
    orbit: Orbit,
    times: Float[Array, "n"],
    field: AbstractMagneticField,
    greenwich_angle_0: float | Float[Array, ""],
    earth_rotation_rate: float | Float[Array, ""] = EARTH_ROTATION_RATE,
    *,
    field_rate: bool = False,
    clock: bool = False,
    atmosphere: ExponentialAtmosphere | None = None,
    sun_eci: Float[Array | np.ndarray, "n 3"] | None = None,
    sun_distance: int | float | Float[Array | np.ndarray, "n"] = AU,
    shadow: CylinderShadow | ConeShadow | None = None,
) -> OrbitTable:
    """Return position and field at `times` [s]; the Greenwich angle [rad] is `greenwich_angle_0` at t = 0.

    On request also the field's rate, which hysteresis rods need; the times themselves, for torques that follow a
    schedule (`clock`); density and velocity of the air, for drag; and, for unit vectors `sun_eci` to the Sun at the
    same times and its distance [m], the pressure of its light, by default with the penumbra of a `ConeShadow`. The
    options are static: compile with `equinox.filter_jit`.
    """
    if shadow is not None and sun_eci is None:
        raise ValueError("tabulate_orbit: shadow is given without sun_eci, the unit vectors to the Sun at `times`")

    def at(t, sun, distance):
        position, velocity = orbit(t)
        angle = greenwich_angle_0 + earth_rotation_rate * t
        b_field, b_rate = _field_and_rate(field, position, velocity, angle, earth_rotation_rate, with_rate=field_rate)
        air_velocity = None if atmosphere is None else air_velocity_eci(position, velocity, earth_rotation_rate)
        return OrbitTable(
            position_eci=position,
            b_field_eci=b_field,
            b_rate_eci=b_rate,
            air_velocity_eci=air_velocity,
            air_density=None if atmosphere is None else atmosphere(position),
            sun_eci=sun,
            solar_pressure=None if sun is None else solar_pressure(position, sun, distance, shadow or ConeShadow()),
            time=t if clock else None,
        )

    sun = None if sun_eci is None else jnp.asarray(sun_eci)
    distance = None if sun is None else jnp.broadcast_to(jnp.asarray(sun_distance, sun.dtype), times.shape)
    return jax.vmap(at)(times, sun, distance)


def _field_and_rate(field, position, velocity, greenwich_angle, rotation_rate, *, with_rate):
    if not with_rate:
        return magnetic_field_eci(field, position, greenwich_angle), None
    # Through the velocity, not through orbit(t): an interpolated or foreign orbit need not be differentiable in time.
    return jax.jvp(
        lambda r, angle: magnetic_field_eci(field, r, angle),
        (position, greenwich_angle),
        (velocity, rotation_rate * jnp.ones_like(greenwich_angle)),
    )


def solar_pressure(
    position_eci: Float[Array, "3"],
    sun_eci: Float[Array, "3"],
    sun_distance: float | Float[Array, ""],
    shadow: CylinderShadow | ConeShadow,
) -> Float[Array, ""]:
    """Return `SOLAR_PRESSURE` (AU / distance)^2 times the visible share of the Sun [Pa]; `sun_eci` is a unit vector."""
    return SOLAR_PRESSURE * (AU / sun_distance) ** 2 * shadow(position_eci, sun_eci)


def tabulate_light(
    orbit: Orbit,
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
        return LightTable(sun, shadow(position_eci, sun), *specular(position_eci, sun), *diffuse(position_eci, sun, t))

    return jax.vmap(at)(times, jnp.asarray(sun_eci))
