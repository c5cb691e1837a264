"""Density of the upper atmosphere and the velocity of a satellite against it."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.math import float_array

# Vallado 2013, table 8-4: base altitude [km], density there [kg/m^3], scale height above [km]. US Standard Atmosphere
# 1976 at the ground, CIRA-72 from 25 km, with an exospheric temperature of 1000 K from 500 km.
_TABLE = np.array(
    [
        [0, 1.225, 7.249],
        [25, 3.899e-2, 6.349],
        [30, 1.774e-2, 6.682],
        [40, 3.972e-3, 7.554],
        [50, 1.057e-3, 8.382],
        [60, 3.206e-4, 7.714],
        [70, 8.770e-5, 6.549],
        [80, 1.905e-5, 5.799],
        [90, 3.396e-6, 5.382],
        [100, 5.297e-7, 5.877],
        [110, 9.661e-8, 7.263],
        [120, 2.438e-8, 9.473],
        [130, 8.484e-9, 12.636],
        [140, 3.845e-9, 16.149],
        [150, 2.070e-9, 22.523],
        [180, 5.464e-10, 29.740],
        [200, 2.789e-10, 37.105],
        [250, 7.248e-11, 45.546],
        [300, 2.418e-11, 53.628],
        [350, 9.518e-12, 53.298],
        [400, 3.725e-12, 58.515],
        [450, 1.585e-12, 60.828],
        [500, 6.967e-13, 63.822],
        [600, 1.454e-13, 71.835],
        [700, 3.614e-14, 88.667],
        [800, 1.170e-14, 124.64],
        [900, 5.245e-15, 181.05],
        [1000, 3.019e-15, 268.00],
    ]
)
# One scale height more, so that the last layer has an upper end to extrapolate through.
_HEIGHTS = 1e3 * np.append(_TABLE[:, 0], _TABLE[-1, 0] + _TABLE[-1, 2])
_LOG_DENSITIES = np.append(np.log(_TABLE[:, 1]), np.log(_TABLE[-1, 1]) - 1.0)


def exponential_density(height: Float[Array, "..."]) -> Float[Array, "..."]:
    """Density of the air [kg/m^3] at a height [m] (Vallado 2013, sec. 8.6.2 and table 8-4).

    Exponential between the densities of the table, each met exactly: continuous, with the slope changing at the
    table's heights. The printed scale heights would leave jumps of 1e-4 there (1.4e-3 at 25 km). Above 1000 km the
    last scale height goes on. A mean over solar activity, which moves the density at 500 km by a factor of several.
    """
    heights, logarithms = (jnp.asarray(table, height.dtype) for table in (_HEIGHTS, _LOG_DENSITIES))
    return jnp.exp(jnp.interp(height, heights, logarithms, left="extrapolate", right="extrapolate"))


def height_above_ellipsoid(
    position: Float[Array, "3"], equatorial_radius: float | Float[Array, ""], flattening: float | Float[Array, ""]
) -> Float[Array, ""]:
    """Height [m] over the point of an ellipsoid on the line to its centre; `position` in any axes with the same z.

    r - a (1 - f) / sqrt(1 - (2 f - f^2) cos^2), cos that of the geocentric latitude: above the geodetic height by
    less than 5 m up to 1000 km, which is below 1e-4 of the density. Flattening zero is a sphere.
    """
    x, y, z = position[0], position[1], position[2]
    across = x * x + y * y
    r2 = across + z * z
    surface = equatorial_radius * (1.0 - flattening) / jnp.sqrt(1.0 - flattening * (2.0 - flattening) * across / r2)
    return jnp.sqrt(r2) - surface


def air_velocity_eci(
    position_eci: Float[Array, "3"],
    velocity_eci: Float[Array, "3"],
    earth_rotation_rate: float | Float[Array, ""] = EARTH_ROTATION_RATE,
) -> Float[Array, "3"]:
    """Velocity of a satellite against air that turns with the Earth, v - omega x r, inertial components [m/s]."""
    x, y = position_eci[0], position_eci[1]
    return velocity_eci - earth_rotation_rate * jnp.stack([-y, x, jnp.zeros_like(x)])


class ExponentialAtmosphere(eqx.Module):
    """The piecewise exponential atmosphere over the Earth's ellipsoid."""

    scale: Float[Array, ""] = eqx.field(converter=float_array, default=1.0)
    """Density over that of the table: solar activity, or what a fit finds."""
    equatorial_radius: Float[Array, ""] = eqx.field(converter=float_array, default=6378137.0)
    """[m], WGS 84."""
    flattening: Float[Array, ""] = eqx.field(converter=float_array, default=1.0 / 298.257223563)
    """WGS 84; zero for a sphere."""

    def __call__(self, position_eci: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the density [kg/m^3] at an inertial position [m]."""
        height = height_above_ellipsoid(position_eci, self.equatorial_radius, self.flattening)
        return self.scale * exponential_density(height)
