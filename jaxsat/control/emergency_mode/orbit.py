"""Where the satellite of the emergency mode flies, and what it meets at ends and middles of control periods."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_EQUATORIAL_RADIUS, EARTH_ROTATION_RATE
from jaxsat.control.emergency_mode.rotating_panels import PanelAngle, PanelMotion, facing_sun, panel_motion
from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S, HEIGHT_KM, INCLINATION_DEG, NODE_DEG, START_UTC
from jaxsat.environment import (
    MOON_MU,
    SUN_MU,
    AbstractMagneticField,
    ConeShadow,
    HarmonicGravity,
    Moon,
    SampledOrbit,
    Sun,
    ThirdBody,
    egm2008,
    igrf_field,
    magnetic_field_eci,
    orbit_from_elements_km_deg,
    propagate_orbit,
    sample_orbit,
    solar_pressure,
)
from jaxsat.math import cross, unit
from jaxsat.time import SECONDS_PER_DAY, Epoch, greenwich_angle

STEP_S = 180.0
"""Of the orbit's integration: some 0.2 m a day."""
BATCH = 4096


class Flight(eqx.Module):
    """The orbit of a mission and its surroundings."""

    orbit: SampledOrbit
    field: AbstractMagneticField
    sun: SampledOrbit
    greenwich_angle_0: Float[Array, ""]
    """[rad]"""
    tt_centuries_0: Float[Array, ""]
    """TT at the start, Julian centuries since J2000."""


class Leg(eqx.Module):
    """The surroundings at ends and middles of control periods: entry 2k begins period k."""

    position_eci: Float[Array, "*nodes 3"]
    """[m]"""
    normal_eci: Float[Array, "*nodes 3"]
    """Unit normal of the orbit."""
    orbit_rate: Float[Array, "*nodes"]
    """At which the vertical turns about it [rad/s]."""
    b_field_eci: Float[Array, "*nodes 3"]
    """[T]"""
    sun_eci: Float[Array, "*nodes 3"]
    """Unit vector to the Sun."""
    solar_pressure: Float[Array, "*nodes"]
    """Eclipses included [Pa]."""
    panels: PanelMotion | None = eqx.field(default=None, kw_only=True)
    """Of panels that turn; None where they stay at -90 deg."""


def fly(
    days: float,
    *,
    degree: int = 8,
    bodies: bool = True,
    argument_of_latitude_deg: float = 0.0,
    start_utc: tuple[int, int, int] = START_UTC,
    height_km: float = HEIGHT_KM,
    inclination_deg: float = INCLINATION_DEG,
    node_deg: float = NODE_DEG,
) -> Flight:
    """The paper's orbit, or another circular one, for some days from its node: gravity to `degree`, with Sun and Moon.

    IGRF of its middle. Raises ValueError unless `days` is positive.
    """
    epoch = Epoch.from_utc(*start_utc)
    stop = days * SECONDS_PER_DAY
    start = orbit_from_elements_km_deg(
        a_km=EARTH_EQUATORIAL_RADIUS / 1e3 + height_km,
        e=0.0,
        i_deg=inclination_deg,
        raan_deg=node_deg,
        argp_deg=0.0,
        mean_anomaly_deg=argument_of_latitude_deg,
    )
    angle = greenwich_angle(epoch)
    # Three hours apart both bodies are known far better than their pull must be.
    sun, moon = (
        sample_orbit(body(epoch.tt_centuries()), start=0.0, stop=stop + 86400.0, step=10800.0) for body in (Sun, Moon)
    )
    pulls = (ThirdBody(SUN_MU, sun), ThirdBody(MOON_MU, moon)) if bodies else ()
    orbit = propagate_orbit(
        *start(jnp.asarray(0.0)), (HarmonicGravity(egm2008(degree), angle), *pulls), stop=stop, step=STEP_S
    )
    field = igrf_field(epoch.shifted(0.5 * stop).decimal_year())
    return Flight(orbit, field, sun, jnp.asarray(angle), jnp.asarray(epoch.tt_centuries()))


def leg(flight: Flight, first: int, periods: int, *, panels: PanelAngle | None = None) -> Leg:
    """The surroundings of `periods` control periods from number `first`; the same program for all of one length.

    `panels` is an equinox module, such as `PanelSlew` or `SunFollowing`; without it they stay at -90 deg.
    """
    half = 0.5 * CONTROL_PERIOD_S
    times = half * (2 * first + np.arange(2 * periods + 1))
    flight.orbit.check_span(times)
    return _tabulated(flight, jnp.asarray(times), panels)


@eqx.filter_jit
def _tabulated(flight, times, panels):
    def at(t):
        position, velocity = flight.orbit(t)
        momentum = cross(position, velocity)
        angle = flight.greenwich_angle_0 + EARTH_ROTATION_RATE * t
        to_sun = flight.sun(t)[0]
        distance = jnp.sqrt(jnp.sum(to_sun**2))
        sun = to_sun / distance
        return Leg(
            position_eci=position,
            normal_eci=unit(momentum),
            orbit_rate=jnp.sqrt(jnp.sum(momentum**2)) / jnp.sum(position**2),
            b_field_eci=magnetic_field_eci(flight.field, position, angle),
            sun_eci=sun,
            solar_pressure=solar_pressure(position, sun, distance, ConeShadow()),
            panels=None if panels is None else panel_motion(panels, t),
        )

    return jax.lax.map(at, times, batch_size=BATCH)


class SunFollowing(eqx.Module):
    """Panels of a satellite in its orbital attitude whose normal stays as near to the Sun as it can, once a turn."""

    flight: Flight

    def __call__(self, t: Float[Array, ""]) -> Float[Array, ""]:
        position, velocity = self.flight.orbit(t)
        wanted = wanted_attitude(position, unit(cross(position, velocity)))
        return facing_sun(wanted.T @ self.flight.sun(t)[0])


def wanted_attitude(position_eci: Float[Array, "3"], normal_eci: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Matrix inertial-from-wanted: x against the orbit's normal, y up, z against the flight (Somov 2018, figure 1)."""
    up = position_eci / jnp.sqrt(jnp.sum(position_eci**2))
    return jnp.stack([-normal_eci, up, cross(up, normal_eci)], axis=1)


def orbital_period(flight: Flight) -> float:
    """Of one turn of the vertical at the start [s]."""
    position, velocity = flight.orbit.position_eci[0], flight.orbit.velocity_eci[0]
    momentum = np.linalg.norm(np.cross(position, velocity))
    return float(2.0 * math.pi * np.sum(np.asarray(position) ** 2) / momentum)
