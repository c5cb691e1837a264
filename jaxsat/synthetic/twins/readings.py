"""What the sensors of a satellite read along a motion, and what of it is sent."""

from collections.abc import Mapping
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment import (
    ConeShadow,
    DiffuseAlbedo,
    SpecularAlbedo,
    Surroundings,
    sun_directions,
    tabulate_light,
)
from jaxsat.files.units import parsed_unit
from jaxsat.satellites.model import Model
from jaxsat.satellites.sections.session import ChannelSettings
from jaxsat.sensors import SunAngles, SunVector, stepped
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.view import View
from jaxsat.time import Epoch

LEAST_SHARP = 1e-3
"""Share of a sensor's sharpness below which its noise grows no more."""
Columns = Mapping[str, tuple[np.ndarray, np.ndarray]]
"""Times [s] and values by column, SI."""


@dataclass(frozen=True)
class Motion:
    """Attitude motion at rising times."""

    t_s: Float[np.ndarray, "n"]
    quaternion: Float[np.ndarray, "n 4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[np.ndarray, "n 3"]
    """Body axes [rad/s]."""
    error: float = 0.0
    """Of the attitude [rad]."""

    def at(self, t_s: Float[np.ndarray, "k"]) -> "Motion":
        """The motion at some of its own times."""
        places = np.searchsorted(self.t_s, t_s)
        return Motion(t_s, self.quaternion[places], self.angular_velocity[places], self.error)


def views(model: Model, around: Surroundings, epoch: Epoch, motion: Motion, columns: Columns, *, light: bool) -> View:
    """What the satellite meets at each time of a motion, one behind the other."""
    sun = sun_directions(epoch, motion.t_s) if light else None
    measured = {name: np.interp(motion.t_s, *pair) for name, pair in columns.items()}
    return _views(model.albedo, around, (motion.t_s, motion.quaternion, motion.angular_velocity), sun, measured)


@eqx.filter_jit
def _views(albedo, around, motion, sun, measured):
    t, q, w = jax.tree.map(jnp.asarray, motion)
    table = around(t)
    position, velocity = jax.vmap(around.orbit)(t)
    light = None
    if sun is not None:
        radius = jnp.asarray(EARTH_RADIUS_MEAN)
        light = tabulate_light(
            around.orbit,
            t,
            jnp.asarray(sun),
            shadow=ConeShadow(radius=radius),
            specular=SpecularAlbedo(radius),
            diffuse=DiffuseAlbedo(radius),
        )

    def one(t, q, w, position, velocity, b_field, light, measured):
        return View(q, w, t, position, velocity, b_field, light, albedo, measured)

    return jax.vmap(one)(t, q, w, position, velocity, table.b_field_eci, light, jax.tree.map(jnp.asarray, measured))


@eqx.filter_jit
def _read(sensor: AbstractSensor, seen: View, sigma, key):
    keys = jax.random.split(key, seen.time.shape[0])
    mean = jax.vmap(lambda view: sensor(view))(seen)
    own = jax.vmap(lambda view: sigma / jnp.maximum(sensor.sharpness(view), LEAST_SHARP))(seen)
    return mean, jax.vmap(sensor.noisy)(mean, own, keys)


def sent(
    sensor: AbstractSensor, seen: View, settings: ChannelSettings, key: jax.Array
) -> tuple[Float[np.ndarray, "n columns"], Float[np.ndarray, "n columns"]]:
    """Mean readings and what is sent of them with noise and steps, in the channel's unit; NaN where nothing is.

    In the Earth's shadow a Sun sensor that tells directions sends none.
    """
    factor = parsed_unit(settings.unit).factor
    sigma = jnp.asarray((settings.sigma or 0.0) * factor)
    mean, noisy = _read(sensor, seen, sigma, key)
    values = np.array(stepped(noisy / factor, jnp.asarray(settings.quantum or 0.0)))
    if isinstance(sensor, SunVector | SunAngles):
        # The model has a direction there too, a real sensor has nothing to send.
        values[np.asarray(seen.lit.illumination) == 0.0] = np.nan
    return np.asarray(mean) / factor, values
