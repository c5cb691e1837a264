"""Many cases of the Earth search at once, or one of them with its history."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from jaxsat.control import closed_loop
from jaxsat.control.earth_search.law import EarthSearchLaw
from jaxsat.control.earth_search.loop import LoopSettings, LoopState, Sample, first_state, one_period
from jaxsat.control.earth_search.sensing import EarthScene
from jaxsat.control.earth_search.vehicle import EarthSearchVehicle, nominal_vehicle
from jaxsat.environment.albedo.infrared import BrightnessMap


class Cases(eqx.Module):
    """What differs from case to case; leaves with the cases in front."""

    quaternion: Float[Array, "cases 4"]
    """inertial-from-body, at the start."""
    angular_velocity: Float[Array, "cases 3"]
    """Body axes, at the start [rad/s]."""
    up: Float[Array, "cases 3"]
    """From the Earth's centre to the spacecraft, unit vector, inertial."""
    along: Float[Array, "cases 3"]
    """Direction of the orbital motion, unit vector, inertial."""
    orbital_rate: Float[Array, "cases"]
    """Of the circular orbit [rad/s]."""
    greenwich: Float[Array, "cases"]
    """Angle of the Earth at the start [rad]."""
    scene: EarthScene
    vehicle: EarthSearchVehicle
    """Leaves with the cases in front, or without where they are common to all."""
    key: Key[Array, " cases"]
    """Of what is thrown."""


def run_cases(
    settings: LoopSettings, law: EarthSearchLaw, cases: Cases, field: BrightnessMap | None, periods: int
) -> LoopState:
    """The state of every case after a number of control periods; leaves with the cases in front.

    The law's leaves may have the cases in front as well, but for where its search begins.
    """
    start = jax.vmap(lambda *motion: first_state(law, *motion))(*_motion(cases))
    loop, fixed = _loop(settings, law, cases, field)
    return closed_loop.run_cases(loop, fixed, start, cases.key, periods)


def run_one(
    settings: LoopSettings,
    law: EarthSearchLaw,
    cases: Cases,
    field: BrightnessMap | None,
    periods: int,
    *,
    number: int | Int[Array, ""] = 0,
) -> tuple[LoopState, Sample]:
    """Final state and history [periods ...] of one of the cases, by its number."""
    start = first_state(law, *(leaf[number] for leaf in _motion(cases)))
    loop, fixed = _loop(settings, law, cases, field)
    return closed_loop.run_one(loop, fixed, start, cases.key[number], periods, number=number)


def _loop(settings, law, cases, field):
    """The loop, and what is fixed in it."""

    def period(law, vehicle, scene, turn, state, coin):
        coin = jnp.zeros(4) if coin is None else coin
        return one_period(settings, law, field, vehicle, scene, turn, state, coin)

    of_cases = cases.scene, orbit_turn(cases.orbital_rate, settings)
    like = jax.eval_shape(EarthSearchLaw), jax.eval_shape(nominal_vehicle), *jax.tree.map(_alone, of_cases)
    loop = closed_loop.ClosedLoop(period, like, _coins if settings.inside == "random" else None)
    return loop, (law, cases.vehicle, *of_cases)


def orbit_turn(orbital_rate: Float[Array, "*n"], settings: LoopSettings) -> Float[Array, "*n 2"]:
    """Cosine and sine of the orbit's turn in a period."""
    angle = orbital_rate * settings.period_s
    return jnp.stack([jnp.cos(angle), jnp.sin(angle)], axis=-1)


def _coins(key):
    return jax.random.uniform(key, (4,))


def _motion(cases):
    return cases.quaternion, cases.angular_velocity, cases.up, cases.along, cases.greenwich


def _alone(leaf):
    return jax.ShapeDtypeStruct(leaf.shape[1:], leaf.dtype)
