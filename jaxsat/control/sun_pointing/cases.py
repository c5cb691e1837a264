"""Many cases of Sun pointing at once, or one of them with its history."""

import functools

import equinox as eqx
import jax
from jaxtyping import Array, Float, Int, Key

from jaxsat.control import closed_loop
from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.control.sun_pointing.loop import LoopSettings, LoopState, Sample, first_state, one_period
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle, nominal_vehicle

NOISES = 11
"""Random numbers of one control period: eight detectors, three rates."""


class Cases(eqx.Module):
    """What differs from case to case; leaves with the cases in front."""

    quaternion: Float[Array, "cases 4"]
    """inertial-from-body, at the start."""
    angular_velocity: Float[Array, "cases 3"]
    """At the start [rad/s]."""
    vehicle: SunPointingVehicle
    """Leaves with the cases in front, or without where they are common to all."""
    key: Key[Array, " cases"]
    """Of the noise."""


def run_cases(
    settings: LoopSettings, law: SunPointingLaw, cases: Cases, sun_eci: Float[Array, "3"], periods: int
) -> LoopState:
    """The state of every case after a number of control periods; leaves with the cases in front.

    The law's leaves may have the cases in front as well.
    """
    start = jax.vmap(functools.partial(first_state, settings))(cases.quaternion, cases.angular_velocity)
    return closed_loop.run_cases(_loop(settings, sun_eci), (law, cases.vehicle), start, cases.key, periods)


def run_one(
    settings: LoopSettings,
    law: SunPointingLaw,
    cases: Cases,
    sun_eci: Float[Array, "3"],
    periods: int,
    *,
    number: int | Int[Array, ""] = 0,
) -> tuple[LoopState, Sample]:
    """Final state and history [periods ...] of one of the cases, by its number."""
    start = first_state(settings, cases.quaternion[number], cases.angular_velocity[number])
    loop, fixed = _loop(settings, sun_eci), (law, cases.vehicle)
    return closed_loop.run_one(loop, fixed, start, cases.key[number], periods, number=number)


def _loop(settings, sun_eci):
    def period(law, vehicle, state, noise):
        return one_period(settings, law, vehicle, sun_eci, state, noise)

    like = (jax.eval_shape(SunPointingLaw), jax.eval_shape(nominal_vehicle))
    return closed_loop.ClosedLoop(period, like, closed_loop.normals(NOISES) if settings.noisy else None)
