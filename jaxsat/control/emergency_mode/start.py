"""Where the transition of the emergency mode begins: at rest in the Sun-ecliptic frame (Somov 2018, section 5).

Before it the satellite holds an attitude against the direction to the Sun and the ecliptic's pole; the paper says that
the orbital attitude is then 11 deg away and the inertial rate small, and nothing more. ASSUMED here: body y, which the
orbital attitude turns up, stands along the pole, and body x as near to the orbit's antinormal as that allows, at a
constant angle from the Sun. The orbit's plane passes 6.7 deg from the pole on the start date, so that of each turn the
orbital attitude comes that near, and twice is 11 deg away: on coming and on going.
"""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.control.emergency_mode.orbit import Flight, orbital_period, wanted_attitude
from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S
from jaxsat.frames import dcm_eci_from_ecliptic
from jaxsat.math import cross, quaternion, unit
from jaxsat.time import DAYS_PER_CENTURY, SECONDS_PER_DAY


def sun_ecliptic_axes(sun_eci: Float[Array, "3"], tt_centuries: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Matrix inertial-from-Sun-ecliptic: z the pole of the ecliptic of date, x the Sun's direction across it."""
    pole = dcm_eci_from_ecliptic(tt_centuries)[:, 2]
    along = unit(sun_eci - jnp.sum(sun_eci * pole) * pole)
    return jnp.stack([along, cross(pole, along), pole], axis=1)


def held_attitude(
    sun_ecliptic: Float[Array, "3 3"], normal_eci: Float[Array, "3"]
) -> tuple[Float[Array, "3 3"], Float[Array, ""]]:
    """Matrix inertial-from-body of the attitude held against the Sun, and body x's angle from it about the pole [rad].

    Body y is the pole; x is what the orbit's antinormal has across it.
    """
    antinormal = -(sun_ecliptic.T @ normal_eci)
    angle = jnp.arctan2(antinormal[1], antinormal[0])
    x = jnp.stack([jnp.cos(angle), jnp.sin(angle), jnp.zeros_like(angle)])
    y = jnp.array([0.0, 0.0, 1.0])
    return sun_ecliptic @ jnp.stack([x, y, cross(x, y)], axis=1), angle


def transition_start(
    flight: Flight, off_deg: float, side: Literal["coming", "going"] = "coming"
) -> tuple[int, Float[Array, "4"], Float[Array, "3"]]:
    """Control period at which the transition begins, quaternion wanted-from-body there, and body rate [rad/s].

    That of the flight's first turn at whose begin the angle between the attitude held and the orbital one is nearest to
    `off_deg`: it changes by up to a degree in a period. The rate is the inertial one of the Sun-ecliptic frame. Raises
    ValueError where the two never come that near.
    """
    times = CONTROL_PERIOD_S * np.arange(int(orbital_period(flight) / CONTROL_PERIOD_S) + 1)

    found = _off(flight, jnp.asarray(times))
    angle = np.degrees(2.0 * np.arccos(np.minimum(np.abs(np.asarray(found)[:, 0]), 1.0)))
    beyond = angle > off_deg
    change = beyond[:-1] & ~beyond[1:] if side == "coming" else ~beyond[:-1] & beyond[1:]
    if not change.any():
        raise ValueError(f"off_deg must be more than {angle.min():.2f} deg, the nearest of the turn, got {off_deg}")
    before = int(np.argmax(change))
    period = before + int(abs(angle[before + 1] - off_deg) < abs(angle[before] - off_deg))
    held = found[period] * jnp.sign(found[period, 0])
    return period, held, _rate(flight, jnp.asarray(times[period]))


@eqx.filter_jit
def _off(flight, times):
    """Quaternions from the orbital attitude to the one held [time, 4]."""

    def off(t):
        position, velocity = flight.orbit(t)
        normal = unit(cross(position, velocity))
        held, _ = held_attitude(_axes(flight, t), normal)
        return quaternion.from_dcm(wanted_attitude(position, normal).T @ held)

    return jax.vmap(off)(times)


def _axes(flight, t):
    to_sun = flight.sun(t)[0]
    return sun_ecliptic_axes(unit(to_sun), flight.tt_centuries_0 + t / (SECONDS_PER_DAY * DAYS_PER_CENTURY))


@eqx.filter_jit
def _rate(flight, t):
    """About the pole, body y, once a year [rad/s]."""
    axes, change = jax.jvp(lambda t: _axes(flight, t), (t,), (jnp.ones_like(t),))
    return jnp.sum(change[:, 0] * axes[:, 1]) * jnp.array([0.0, 1.0, 0.0])
