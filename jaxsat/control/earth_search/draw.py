"""Random cases of the Earth search: attitude, rate, orbit, date with Sun and Moon, brightness, one failed sensor."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Key

from jaxsat.constants import EARTH_MU, EARTH_RADIUS_MEAN
from jaxsat.control.earth_search.cases import Cases
from jaxsat.control.earth_search.sensing import EarthScene
from jaxsat.control.earth_search.vehicle import MOUNTING_DEG, nominal_vehicle
from jaxsat.environment.albedo.infrared import MEAN_BRIGHTNESS, MIN_BRIGHTNESS
from jaxsat.environment.moon import moon_position
from jaxsat.environment.sun import sun_direction
from jaxsat.math import angle_between, cross, quaternion, unit

Failure = Literal["none", "replaced", "silent", "stuck"]
CENTURIES = 0.19
"""Epochs are drawn from 2000 to 2018, a period of the Moon's node."""


@dataclass(frozen=True)
class Dispersions:
    """What the cases are drawn from."""

    size: str = "large"
    altitude_km: float = 800.0
    altitude_spread_km: float = 0.0
    """To both sides, uniform."""
    max_rate_deg_s: float = 0.05
    """Of each axis at the start."""
    failure: Failure = "none"
    even: bool = False
    """Whether every Earth has the mean brightness, not one between the least and the mean."""
    mounting: float = math.radians(MOUNTING_DEG)
    """Of the sensors from the body axis [rad]."""
    acceleration_deg_s2: float | None = None
    """Largest of each axis; None: that of a spacecraft of the size, as the lag."""
    lag_s: float | None = None
    still: bool = False
    """Whether the Earth's centre stays where it is, as if there were no orbit."""


def draw_cases(dispersions: Dispersions, keys: Key[Array, " cases"]) -> Cases:
    """One case for each key; a case does not depend on how many there are."""
    drawn = jax.vmap(lambda key: _case(dispersions, key))(keys)
    vehicle = nominal_vehicle(
        dispersions.size,
        dispersions.mounting,
        acceleration_deg_s2=dispersions.acceleration_deg_s2,
        lag_s=dispersions.lag_s,
    )
    if dispersions.failure != "none":
        which = jax.vmap(lambda key: jax.random.randint(jax.random.fold_in(key, 1), (), 0, 4))(keys)
        failed = which[:, None] == jnp.arange(4)[None]
        place = {"replaced": "on_spare", "silent": "silent", "stuck": "stuck"}[dispersions.failure]
        vehicle = eqx.tree_at(lambda vehicle: getattr(vehicle, place), vehicle, failed)
    return Cases(vehicle=vehicle, **drawn)


def scene_at(radius, sun, moon, moon_lit, brightness) -> EarthScene:
    """The sky from a distance from the Earth's centre [m]."""
    disk = jnp.arcsin(EARTH_RADIUS_MEAN / radius)
    return EarthScene(disk, jnp.cos(disk), radius / EARTH_RADIUS_MEAN, sun, moon, moon_lit, brightness)


def _case(dispersions: Dispersions, key) -> dict[str, Any]:
    keys = jax.random.split(key, 9)
    q = quaternion.normalize(jax.random.normal(keys[0], (4,)))
    w = math.radians(dispersions.max_rate_deg_s) * jax.random.uniform(keys[1], (3,), minval=-1.0)
    # Any orbital plane, any place in it.
    up = unit(jax.random.normal(keys[2], (3,)))
    along = unit(cross(unit(jax.random.normal(keys[3], (3,))), up))
    altitude = dispersions.altitude_km + dispersions.altitude_spread_km * jax.random.uniform(keys[4], minval=-1.0)
    radius = EARTH_RADIUS_MEAN + 1e3 * altitude
    centuries = CENTURIES * jax.random.uniform(keys[5])
    sun, _ = sun_direction(centuries)
    moon = moon_position(centuries)
    # Full where the Sun is opposite; the phase angle is 180 deg less the elongation, to 0.15 deg.
    lit = 0.5 * (1.0 - jnp.cos(angle_between(moon, sun)))
    level = MIN_BRIGHTNESS + (MEAN_BRIGHTNESS - MIN_BRIGHTNESS) * jax.random.uniform(keys[6])
    brightness = jnp.asarray(MEAN_BRIGHTNESS) if dispersions.even else level
    return dict(
        quaternion=q,
        angular_velocity=w,
        up=up,
        along=along,
        orbital_rate=jnp.zeros_like(radius) if dispersions.still else jnp.sqrt(EARTH_MU / radius) / radius,
        greenwich=2.0 * math.pi * jax.random.uniform(keys[7]),
        scene=scene_at(radius, sun, unit(moon), lit, brightness),
        key=keys[8],
    )
