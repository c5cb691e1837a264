"""What surrounds the satellite at the samples, in inertial axes: what a sensor's view is made of."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.stored import Stored
from jaxsat.environment import (
    AbstractMagneticField,
    ConeShadow,
    CylinderShadow,
    DiffuseAlbedo,
    ExponentialAtmosphere,
    LightTable,
    OrbitTable,
    SpecularAlbedo,
    sun_directions,
    tabulate_light,
    tabulate_orbit,
)
from jaxsat.environment.orbit import AbstractOrbit
from jaxsat.math import quaternion
from jaxsat.sensors import Albedo
from jaxsat.sensors.view import View
from jaxsat.time import Epoch


class Sky(eqx.Module):
    """Surroundings at samples; leaves have the samples in front."""

    time: Float[Array, "*samples"]
    """[s]"""
    position_eci: Float[Array, "*samples 3"]
    velocity_eci: Float[Array, "*samples 3"]
    b_field_eci: Float[Array, "*samples 3"]
    b_rate_eci: Float[Array, "*samples 3"]
    """Rate of the field's inertial components along the orbit [T/s]."""
    light: LightTable | None
    columns: Mapping[str, Float[Array, "*samples"]]
    """Telemetered numbers that sensors read."""

    def view(
        self,
        attitude: Float[Array, "4"],
        rate: Float[Array, "3"],
        acceleration: Float[Array, "3"],
        albedo: Albedo,
        earlier: Float[Array, ""] | None,
    ) -> View:
        """What a sensor saw at one sample, or so many seconds `earlier`: a stamp that is late.

        The body turned at its `rate` with its angular `acceleration`, to the third order of the delay.
        """
        if earlier is None:
            return View(
                attitude, rate, self.time, self.position_eci, self.velocity_eci, self.b_field_eci, self.light, albedo,
                self.columns,
            )  # fmt: skip
        turn = -earlier * rate + 0.5 * earlier**2 * acceleration
        return View(
            quaternion.multiply(attitude, quaternion.from_rotation_vector(turn)),
            rate - earlier * acceleration,
            self.time - earlier,
            self.position_eci - earlier * self.velocity_eci,
            self.velocity_eci,
            self.b_field_eci - earlier * self.b_rate_eci,
            self.light,
            albedo,
            self.columns,
        )


class Around(eqx.Module):
    """Orbit, field and the Earth's turn: what a sky is computed from."""

    orbit: AbstractOrbit
    field: AbstractMagneticField
    greenwich_angle: Float[Array | np.ndarray, ""]
    """At t = 0 [rad]."""
    rotation_rate: Float[Array | np.ndarray, ""]
    """[rad/s]"""
    earth_radius: Float[Array | np.ndarray, ""]
    """Of shadow and albedo [m]."""
    field_rate: bool = eqx.field(static=True, default=False)
    """Whether torques want it: hysteresis rods do."""
    pushed: bool = eqx.field(static=True, default=False)
    """Whether air and sunlight push on the satellite."""
    sharp: bool = eqx.field(static=True, default=False)
    """Whether the Earth's shadow has a sharp edge and no penumbra."""
    fixed_sun: Float[Array | np.ndarray, "3"] | None = None
    """Unit vector to the Sun where it is given; None where it follows from the epoch."""

    def sun_eci(self, epoch: Epoch, t_s: np.ndarray) -> np.ndarray:
        """[time 3] unit vectors to the Sun at times after the epoch [s]."""
        fixed = None if self.fixed_sun is None else np.asarray(self.fixed_sun).tolist()
        return sun_directions(epoch, t_s, fixed=fixed)


def _sky(
    around: Around,
    times: Float[Array | np.ndarray, " samples"],
    sun_eci: Float[Array | np.ndarray, "samples 3"] | None,
    columns: Mapping[str, Array],
) -> Sky:
    """The sky at `times` [s]; without unit vectors to the Sun there is no light in it."""
    times = jnp.asarray(times)
    position, velocity = jax.vmap(around.orbit)(times)
    table = _table_of(around, times, True)
    light = None
    if sun_eci is not None:
        radius = jnp.asarray(around.earth_radius)
        # Both albedos on the sphere of the shadow.
        light = tabulate_light(
            around.orbit,
            times,
            jnp.asarray(sun_eci),
            shadow=CylinderShadow(radius) if around.sharp else ConeShadow(radius=radius),
            specular=SpecularAlbedo(radius),
            diffuse=DiffuseAlbedo(radius),
        )
    assert table.b_rate_eci is not None
    return Sky(times, position, velocity, table.b_field_eci, table.b_rate_eci, light, dict(columns))


def _nodes(
    around: Around, times: Float[Array | np.ndarray, " nodes"], sun_eci: Float[Array | np.ndarray, "nodes 3"] | None
) -> OrbitTable:
    """What the torques read at the nodes of a grid."""
    return _table_of(around, jnp.asarray(times), around.field_rate, sun_eci)


def _table_of(around, times, field_rate, sun_eci=None):
    pushed = around.pushed and sun_eci is not None
    return tabulate_orbit(
        around.orbit,
        times,
        around.field,
        jnp.asarray(around.greenwich_angle),
        jnp.asarray(around.rotation_rate),
        field_rate=field_rate,
        atmosphere=ExponentialAtmosphere() if pushed else None,
        sun_eci=jnp.asarray(sun_eci) if pushed else None,
    )


sky_at = Stored(_sky, quick=True)
nodes_at = Stored(_nodes, quick=True)
