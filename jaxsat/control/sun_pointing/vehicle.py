"""The vehicle of the Sun-pointing study: every number that the paper does not give, in one place.

Zhukov 2019 publishes the sensor, its mounting and nothing else of the vehicle. ASSUMED here: a lander-sized spacecraft
of some tonne, two-newton thrusters in couples, a rate gyro, one control period a second. `SunPointingLaw` holds the
assumed numbers of the law.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.control.actuators import Thrusters
from jaxsat.sensors.sun_sensor import PyramidSunSensor

INERTIA_KG_M2 = np.array([[620.0, 12.0, -8.0], [12.0, 840.0, 15.0], [-8.0, 15.0, 1050.0]])
TORQUE_N_M, LEVER_M, MIN_PULSE_S = (2.4, 2.4, 2.4), 1.2, 0.03
"""Two thrusters of 1 N, 1.2 m from the axis."""
EXHAUST_SPEED_M_S = 2158.0
"""Of monopropellant thrusters, 220 s of specific impulse."""
CONTROL_PERIOD_S = 1.0
MAX_RATE_DEG_S = 3.0
"""Largest initial angular rate."""
BODY_FROM_INSTRUMENT = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Zhukov 2019, eq. 22: the sensor's axis is -z of the body."""
READING_STEP = 1.0 / 4096.0
"""Of the sensor's converter, over the maximum current, where readings are quantised."""


class SunPointingVehicle(eqx.Module):
    """What is true of one vehicle, and what its computer takes for true."""

    inertia: Float[Array, "3 3"]
    """[kg m^2]"""
    inverse_inertia: Float[Array, "3 3"]
    thrusters: Thrusters
    sensor: PyramidSunSensor
    body_from_instrument: Float[Array, "3 3"]
    """Of the sensor as it is mounted."""
    detector_gain: Float[Array, "4 2"]
    """Of each detector; 0 where it has failed."""
    gyro_bias: Float[Array, "3"]
    """[rad/s]"""
    assumed_inertia: Float[Array, "3 3"]
    assumed_body_from_instrument: Float[Array, "3 3"]


def nominal_vehicle(
    *,
    inertia_kg_m2: Float[np.ndarray, "3 3"] = INERTIA_KG_M2,
    torque_N_m: tuple[float, ...] = TORQUE_N_M,
    lever_m: float = LEVER_M,
    min_pulse_s: float = MIN_PULSE_S,
) -> SunPointingVehicle:
    """The vehicle as it was designed; the `torque_N_m` of each axis is that of a couple at the lever from it."""
    inertia = jnp.asarray(inertia_kg_m2)
    mounting = jnp.asarray(BODY_FROM_INSTRUMENT)
    thrusters = Thrusters(np.array(torque_N_m), np.eye(3), lever_m, min_pulse_s, np.eye(3))
    return SunPointingVehicle(
        inertia=inertia,
        inverse_inertia=jnp.asarray(np.linalg.inv(inertia_kg_m2)),
        thrusters=thrusters,
        sensor=PyramidSunSensor(),
        body_from_instrument=mounting,
        detector_gain=jnp.ones((4, 2)),
        gyro_bias=jnp.zeros(3),
        assumed_inertia=inertia,
        assumed_body_from_instrument=mounting,
    )
