"""Many cases of Sun pointing at once, or one of them with its history."""

import functools

import equinox as eqx
import jax
from jaxtyping import Array, Float, Int, Key

from jaxsat.control import closed_loop
from jaxsat.control.loops import LoopState, Motion, Plant, Sample, Schedule, first_state, loop, unchanging
from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.control.sun_pointing.loop import SunPointingWatch, parts
from jaxsat.control.sun_pointing.sensing import LoopSettings
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle, nominal_vehicle


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
    made, first = _loop(settings, sun_eci, periods)
    start = jax.vmap(first)(Motion(cases.quaternion, cases.angular_velocity))
    return closed_loop.run_cases(made, parts(settings, law, cases.vehicle), start, cases.key, periods)


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
    made, first = _loop(settings, sun_eci, periods)
    start = first(Motion(cases.quaternion[number], cases.angular_velocity[number]))
    fixed = parts(settings, law, cases.vehicle)
    return closed_loop.run_one(made, fixed, start, cases.key[number], periods, number=number)


def _loop(settings, sun_eci, periods):
    """The loop, and the function that begins a case of it."""
    schedule, watch = Schedule(settings.period_s, settings.period_s), SunPointingWatch(settings.period_s)
    vehicle, channels, estimator, controller = parts(settings, SunPointingLaw(), nominal_vehicle())
    plant = Plant(vehicle, channels, unchanging(schedule, periods, sun_eci))
    made = loop(plant, estimator, controller, schedule, watch=watch, noisy=settings.noisy)
    return made, functools.partial(first_state, plant, estimator, controller, watch=watch)
