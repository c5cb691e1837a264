"""An orbit with all that a satellite meets on it, ready to be tabulated at any times."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import AU, EARTH_ROTATION_RATE
from jaxsat.environment.atmosphere import ExponentialAtmosphere
from jaxsat.environment.commands import Commands
from jaxsat.environment.magnetic import AbstractMagneticField
from jaxsat.environment.orbit import AbstractOrbit
from jaxsat.environment.shadow import ConeShadow, CylinderShadow
from jaxsat.environment.table import OrbitTable, tabulate_orbit
from jaxsat.math import float_array


class Surroundings(eqx.Module):
    """Orbit, field and what else the torques want; calling it with times [s] gives their table.

    Every number in it is a leaf, so that derivatives by orbital elements or field coefficients flow.
    """

    orbit: AbstractOrbit
    field: AbstractMagneticField
    greenwich_angle_0: Float[Array, ""] = eqx.field(converter=float_array)
    """At t = 0 [rad]."""
    earth_rotation_rate: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_ROTATION_RATE)
    """[rad/s]."""
    field_rate: bool = eqx.field(static=True, default=False)
    """Whether the field's rate is wanted, as by hysteresis rods."""
    atmosphere: ExponentialAtmosphere | None = None
    sun: AbstractOrbit | None = None
    """Apparent position of the Sun, such as `Sun`, for the pressure of its light."""
    shadow: CylinderShadow | ConeShadow | None = None
    commands: Commands | None = None
    """What the satellite's coils and wheels were commanded."""
    clock: bool = eqx.field(static=True, default=False)
    """Whether torques are told the time (`BodyEnvironment.time`)."""

    def __call__(self, times: Float[Array | np.ndarray, " n"]) -> OrbitTable:
        """Return the table at `times` [s]; see `tabulate_orbit`."""
        times = jnp.asarray(times)
        sun_eci, sun_distance = None, AU
        if self.sun is not None:
            to_sun, _ = jax.vmap(self.sun)(times)
            sun_distance = jnp.sqrt(jnp.sum(to_sun**2, axis=-1))
            sun_eci = to_sun / sun_distance[:, None]
        table = tabulate_orbit(
            self.orbit,
            times,
            self.field,
            self.greenwich_angle_0,
            self.earth_rotation_rate,
            field_rate=self.field_rate,
            clock=self.clock,
            atmosphere=self.atmosphere,
            sun_eci=sun_eci,
            sun_distance=sun_distance,
            shadow=self.shadow,
        )
        return table if self.commands is None else dataclasses.replace(table, commands=self.commands(times))
