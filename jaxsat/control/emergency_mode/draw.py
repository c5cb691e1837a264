"""Random cases of the emergency mode: how far off they begin, and what a satellite may differ by from its drawing."""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Key

from jaxsat.control.emergency_mode.cases import Cases
from jaxsat.control.emergency_mode.loop import first_state
from jaxsat.control.emergency_mode.orbit import Leg
from jaxsat.control.emergency_mode.vehicle import EmergencyVehicle, nominal_vehicle
from jaxsat.math import inverse_3x3, quaternion, unit


@dataclass(frozen=True)
class Dispersions:
    """How far a case may be from the paper's; zero but for the start by default."""

    min_error_deg: float = 0.0
    max_error_deg: float = 30.0
    """The attitude error at the start is uniform between the two, about an axis uniform over all."""
    max_rate_deg_s: float = 0.01
    """Rate at the start, uniform to it, in any direction: inertial, or against the orbital axes."""
    orbital: bool = False
    """Whether the start turns with the orbit, as a satellite that swings does, or hardly at all."""
    inertia: float = 0.0
    """1-sigma of each moment, relative, as it is not known to the computer."""
    field: float = 0.0
    """1-sigma of the true field over the model: of its size, relative, and of its direction, rad."""
    magnetometer: float = 0.0
    """1-sigma of the elements of the magnetometer's matrix."""


def draw_cases(
    dispersions: Dispersions, leg: Leg, keys: Key[Array, " cases"], nominal: EmergencyVehicle | None = None
) -> Cases:
    """One case for each key, at the leg's first node; a case does not depend on how many there are.

    They differ from the `nominal` satellite, by default that of the paper.
    """
    designed = nominal_vehicle() if nominal is None else nominal
    return jax.vmap(lambda key: _case(dispersions, leg, key, designed))(keys)


def _case(dispersions: Dispersions, leg: Leg, key, nominal: EmergencyVehicle) -> Cases:
    keys = jax.random.split(key, 8)
    low, high = math.radians(dispersions.min_error_deg), math.radians(dispersions.max_error_deg)
    angle = jax.random.uniform(keys[0], minval=low, maxval=high)
    off = quaternion.from_rotation_vector(angle * unit(jax.random.normal(keys[1], (3,))))
    size = math.radians(dispersions.max_rate_deg_s) * jax.random.uniform(keys[2])
    rate = size * unit(jax.random.normal(keys[3], (3,)))
    if dispersions.orbital:
        rate = rate - quaternion.rotate_inverse(off, leg.orbit_rate[0] * jnp.array([1.0, 0.0, 0.0]))
    moments = jnp.diag(nominal.inertia) * (1.0 + dispersions.inertia * jax.random.normal(keys[4], (3,)))
    inertia = jnp.diag(moments)
    turn = quaternion.from_rotation_vector(dispersions.field * jax.random.normal(keys[5], (3,)))
    strength = 1.0 + dispersions.field * jax.random.normal(keys[6])
    shown = jnp.eye(3) + dispersions.magnetometer * jax.random.normal(keys[7], (3, 3))
    vehicle = EmergencyVehicle(
        inertia=inertia,
        inverse_inertia=inverse_3x3(inertia),
        assumed_inertia=nominal.assumed_inertia,
        field_error=strength * quaternion.to_dcm(turn),
        magnetometer_error=shown,
        panel_inertia=nominal.panel_inertia,
        sigmas=nominal.sigmas,
    )
    return Cases(first_state(leg, off, rate, vehicle), vehicle, jax.random.fold_in(key, 8))
