"""Random cases of Sun pointing: attitude and rate as in Zhukov 2019, and what a vehicle may be off by."""

import math
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from jaxsat.control.sun_pointing.cases import Cases
from jaxsat.control.sun_pointing.vehicle import MAX_RATE_DEG_S, SunPointingVehicle, nominal_vehicle
from jaxsat.math import inverse_3x3, quaternion, unit


@dataclass(frozen=True)
class Dispersions:
    """How far a vehicle may be from what its computer takes for true; all zero by default."""

    max_rate_deg_s: float = MAX_RATE_DEG_S
    """Initial rates are uniform to it, in any direction."""
    inertia: float = 0.0
    """1-sigma of each moment, relative; products that of the mean moment."""
    thrust: float = 0.0
    """1-sigma of each axis' torque, relative."""
    thruster_deg: float = 0.0
    """1-sigma of the direction of each axis' torque, about each of two axes across."""
    mounting_deg: float = 0.0
    """1-sigma of the turn of the sensor about each of its axes."""
    gyro_bias_deg_s: float = 0.0
    """1-sigma of each axis' bias."""
    detector_failures: float = 0.0
    """Probability that a face has lost one of its two detectors."""
    dead_faces: float = 0.0
    """Probability that a face has lost both."""
    detector_gain: float = 0.0
    """1-sigma of each detector's gain, relative."""

    @property
    def vehicles_differ(self) -> bool:
        """Whether anything but the initial motion is drawn."""
        spread = (self.inertia, self.thrust, self.thruster_deg, self.mounting_deg, self.gyro_bias_deg_s)
        detectors = (self.detector_failures, self.dead_faces, self.detector_gain)
        return any(value > 0.0 for value in (*spread, *detectors))


def draw_cases(
    dispersions: Dispersions, keys: Key[Array, " cases"], nominal: SunPointingVehicle | None = None
) -> Cases:
    """One case for each key; a case does not depend on how many there are.

    They differ from the `nominal` vehicle, by default that of the study.
    """
    q, w, noise = jax.vmap(lambda key: _motion(dispersions, key))(keys)
    vehicle = designed = nominal_vehicle() if nominal is None else nominal
    if dispersions.vehicles_differ:
        vehicle = jax.vmap(lambda key: _vehicle(dispersions, jax.random.fold_in(key, 1), designed))(keys)
    return Cases(q, w, vehicle, noise)


def _motion(dispersions: Dispersions, key) -> tuple[Float[Array, "4"], Float[Array, "3"], Array]:
    attitude, axis, size, noise = jax.random.split(key, 4)
    q = jax.random.normal(attitude, (4,))
    rate = math.radians(dispersions.max_rate_deg_s) * jax.random.uniform(size)
    return quaternion.normalize(q), rate * unit(jax.random.normal(axis, (3,))), noise


def _vehicle(dispersions: Dispersions, key, nominal: SunPointingVehicle) -> SunPointingVehicle:
    keys = jax.random.split(key, 7)
    dead_key, gain_key = jax.random.split(jax.random.fold_in(key, 1))
    J = nominal.inertia
    off = jax.random.normal(keys[0], (3, 3))
    products = jnp.tril(off, -1) * (jnp.trace(J) / 3.0)
    J = J + dispersions.inertia * (jnp.diag(jnp.diag(off) * jnp.diag(J)) + products + products.T)
    torque = nominal.thrusters.torque * (1.0 + dispersions.thrust * jax.random.normal(keys[1], (3,)))
    tilt = math.radians(dispersions.thruster_deg) * jax.random.normal(keys[2], (3, 3))
    # Row k is axis k, moved by its tilt across itself.
    axes = unit(jnp.eye(3) + tilt * (1.0 - jnp.eye(3))).T
    turn = math.radians(dispersions.mounting_deg) * jax.random.normal(keys[3], (3,))
    mounting = nominal.body_from_instrument @ quaternion.to_dcm(quaternion.from_rotation_vector(turn))
    bias = math.radians(dispersions.gyro_bias_deg_s) * jax.random.normal(keys[4], (3,))
    fails = jax.random.uniform(keys[5], (4, 1)) < dispersions.detector_failures
    which = jax.random.uniform(keys[6], (4, 1)) < 0.5
    lost = fails & jnp.concatenate([which, ~which], axis=1)
    lost = lost | (jax.random.uniform(dead_key, (4, 1)) < dispersions.dead_faces)
    gain = 1.0 + dispersions.detector_gain * jax.random.normal(gain_key, (4, 2))
    return eqx.tree_at(
        lambda v: (
            v.inertia,
            v.inverse_inertia,
            v.thrusters.torque,
            v.thrusters.axes_body,
            v.body_from_instrument,
            v.gyro_bias,
            v.detector_gain,
        ),
        nominal,
        (J, inverse_3x3(J), torque, axes, mounting, bias, jnp.where(lost, 0.0, gain)),
    )
