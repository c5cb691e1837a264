"""Many cases of Sun pointing at once: the closed loop replayed on arrays over the cases, in one scan."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.control.sun_pointing.loop import LoopSettings, LoopState, Sample, first_state, one_period
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle, nominal_vehicle
from jaxsat.math.case_scan import scan_cases
from jaxsat.math.scalars import elements

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
    craft, plan = jax.eval_shape(nominal_vehicle), jax.eval_shape(SunPointingLaw)

    def step(law, vehicle, state, *noise):
        return one_period(settings, law, vehicle, sun_eci, state, noise[0] if noise else None)[0]

    def noise(number):
        one = jax.vmap(lambda key: jax.random.normal(jax.random.fold_in(key, number), (NOISES,)))(cases.key)
        return (elements(one.T, element_rank=1),)

    start = jax.vmap(functools.partial(first_state, settings))(cases.quaternion, cases.angular_velocity)
    fixed = (law, cases.vehicle), (plan, craft)
    if not settings.noisy:
        return scan_cases(step, *fixed, start, periods)
    like = jax.ShapeDtypeStruct((NOISES,), cases.quaternion.dtype)
    return scan_cases(step, *fixed, start, periods, drawn=noise, drawn_like=(like,))


def run_one(
    settings: LoopSettings, law: SunPointingLaw, case: Cases, sun_eci: Float[Array, "3"], periods: int
) -> tuple[LoopState, Sample]:
    """Final state and history [periods ...] of a single case, `Cases` of one."""
    vehicle = jax.tree.map(
        lambda leaf, like: leaf[0] if leaf.ndim > like.ndim else leaf, case.vehicle, jax.eval_shape(nominal_vehicle)
    )
    start = first_state(settings, case.quaternion[0], case.angular_velocity[0])

    def advance(state, number):
        noise = jax.random.normal(jax.random.fold_in(case.key[0], number), (NOISES,)) if settings.noisy else None
        return one_period(settings, law, vehicle, sun_eci, state, noise)

    return jax.lax.scan(advance, start, jnp.arange(periods))
