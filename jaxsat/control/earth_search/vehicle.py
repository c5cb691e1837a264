"""What the Earth search flies on: sensors, their spares, actuators. What the paper does not give is ASSUMED here.

Melnikov et al. 2022 give the rates of a large and of a small spacecraft, the scan and its threshold. Assumed are the
accelerations and lags, the spares' places, the sizes of the field of view and of the static Sun sensor's.
"""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.math import float_array
from jaxsat.sensors.horizon_sensor import HorizonSensor

MOUNTING_DEG = 62.677811
"""Of the scans' centres from the axis: the horizon's angle at 800 km."""
SPARE_AZIMUTH_DEG = 30.0
"""A spare looks this far in azimuth beside the sensor that it stands for, so that the Sun does not strike both."""
FIELD_DEG = 0.5
"""Half-width of the momentary field of view."""
SUN_MARGIN_DEG = 2.0
"""By which the field of the static Sun sensor exceeds the scanned one, to all sides."""
MOON_SIGNAL = 0.182
"""Of the full Moon over that of an Earth of mean brightness (Melnikov et al. 2022)."""
SUN_SIGNAL = 400.0
"""Of the Sun over the same: black bodies of 5800 and 220 K at 15 um."""


class EarthSearchVehicle(eqx.Module):
    """Actuators and sensors of one spacecraft."""

    sensor: HorizonSensor
    azimuths: Float[Array, "4 2"]
    """Of the sensors +x, +y, -x, -y: unit vectors in body x and y."""
    spare_azimuths: Float[Array, "4 2"]
    on_spare: Bool[Array, "4"]
    """Known to have failed and replaced."""
    silent: Bool[Array, "4"]
    """Failed unknown to all: never signals."""
    stuck: Bool[Array, "4"]
    """Failed unknown to all: always signals."""
    acceleration: Float[Array, ""] = eqx.field(converter=float_array)
    """Largest angular acceleration of each axis [rad/s^2]."""
    lag: Float[Array, ""] = eqx.field(converter=float_array)
    """Time constant with which the rate follows the command [s]."""


def nominal_vehicle(
    size: str = "large",
    mounting: float = math.radians(MOUNTING_DEG),
    *,
    acceleration_deg_s2: float | None = None,
    lag_s: float | None = None,
) -> EarthSearchVehicle:
    """A sound spacecraft, `large` (0.005 deg/s^2, 20 s) or `small` (0.2 deg/s^2, 2 s), or with numbers of its own.

    `mounting` is the angle of the sensors from the axis [rad].
    """
    acceleration_deg, lag = {"large": (0.005, 20.0), "small": (0.2, 2.0)}[size]
    acceleration_deg = acceleration_deg if acceleration_deg_s2 is None else acceleration_deg_s2
    lag = lag if lag_s is None else lag_s
    turned = math.radians(SPARE_AZIMUTH_DEG)
    c, s = math.cos(turned), math.sin(turned)
    none = jnp.zeros(4, bool)
    return EarthSearchVehicle(
        sensor=HorizonSensor(mounting),
        azimuths=jnp.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]),
        spare_azimuths=jnp.array([[c, s], [-s, c], [-c, -s], [s, -c]]),
        on_spare=none,
        silent=none,
        stuck=none,
        acceleration=math.radians(acceleration_deg),
        lag=lag,
    )
