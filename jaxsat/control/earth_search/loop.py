"""The closed loop of the Earth search: sky, sensors, automaton, rates that follow with lag, attitude and orbit."""

import math
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.control.earth_search.law import TRACK, EarthSearchLaw, SearchMemory, decide, first_memory
from jaxsat.control.earth_search.sensing import EarthScene, Inside, SunChoice, sense
from jaxsat.control.earth_search.vehicle import EarthSearchVehicle
from jaxsat.environment.albedo.infrared import BrightnessMap
from jaxsat.math import angle_between, quaternion


@dataclass(frozen=True)
class LoopSettings:
    """What is fixed for all cases of a program."""

    period_s: float = 4.0
    inside: Inside = "brightness"
    sun: SunChoice = "blocked"
    moon: bool = True


class LoopState(eqx.Module):
    """Motion, memory and tally of one case."""

    quaternion: Float[Array, "4"]
    angular_velocity: Float[Array, "3"]
    up: Float[Array, "3"]
    along: Float[Array, "3"]
    greenwich: Float[Array, "2"]
    """Cosine and sine of the Earth's angle."""
    memory: SearchMemory
    time: Float[Array, ""]
    first_signal: Float[Array, ""]
    """When any sensor first signalled [s]; inf before, as below."""
    first_capture: Float[Array, ""]
    """When tracking first began [s]."""
    last_capture: Float[Array, ""]
    """When tracking last began [s]."""
    captures: Float[Array, ""]
    """How often it began."""


class Sample(eqx.Module):
    """One step as a person would plot it."""

    nadir_body: Float[Array, "3"]
    present: Bool[Array, "4"]
    first: Float[Array, "4"]
    """First harmonics [W/(m^2 sr)]."""
    inside: Bool[Array, "4"]
    mode: Int[Array, ""]
    direction: Float[Array, "2"]
    angular_velocity: Float[Array, "3"]
    """[rad/s]"""
    error: Float[Array, ""]
    """From body z to the nadir [rad]."""
    azimuths: Float[Array, "4 2"]
    """Of the sensors in use, a spare's where it stands for one."""
    sun_body: Float[Array, "3"]
    moon_body: Float[Array, "3"]


def first_state(law: EarthSearchLaw, q, w, up, along, greenwich) -> LoopState:
    """At the start of a case."""
    zero, never = jnp.asarray(0.0), jnp.asarray(jnp.inf)
    angle = jnp.stack([jnp.cos(greenwich), jnp.sin(greenwich)])
    return LoopState(q, w, up, along, angle, first_memory(law), zero, never, never, never, zero)


def one_period(
    settings: LoopSettings,
    law: EarthSearchLaw,
    field: BrightnessMap | None,
    vehicle: EarthSearchVehicle,
    scene: EarthScene,
    orbit_turn: Float[Array, "2"],
    state: LoopState,
    coin: Float[Array, "4"],
) -> tuple[LoopState, Sample]:
    """One case one period on: look, decide, turn. `orbit_turn` is cosine and sine of the orbit's turn in a period."""
    hold, period = jax.lax.optimization_barrier, settings.period_s
    dcm = hold(quaternion.to_dcm(state.quaternion))
    seen = hold(
        sense(
            vehicle,
            scene,
            dcm,
            state.up,
            state.greenwich,
            coin,
            inside=settings.inside,
            sun=settings.sun,
            moon=settings.moon,
            field=field,
        )
    )
    w = state.angular_velocity
    motion = jnp.stack([w[1], -w[0]])
    memory, command = hold(decide(law, state.memory, seen.signals, seen.azimuths, motion, period))

    wanted = jnp.stack([-command[1], command[0], jnp.zeros_like(command[0])])
    limit = vehicle.acceleration * period
    new_w = hold(w + jnp.clip((1.0 - jnp.exp(-period / vehicle.lag)) * (wanted - w), -limit, limit))
    turn = hold(turn_quaternion(0.5 * period * (w + new_w)))
    q = hold(quaternion.multiply(state.quaternion, turn))
    # A step of Newton's towards norm one suffices: it was one a step ago.
    q = q * (1.5 - 0.5 * jnp.sum(q * q))
    c, s = orbit_turn
    cosine, sine = state.greenwich
    c_earth, s_earth = (f(EARTH_ROTATION_RATE * period) for f in (math.cos, math.sin))

    begins = (memory.mode == TRACK) & (state.memory.mode != TRACK)
    signal = jnp.any(seen.signals.present)
    after = LoopState(
        quaternion=q,
        angular_velocity=new_w,
        up=c * state.up + s * state.along,
        along=c * state.along - s * state.up,
        greenwich=jnp.stack([c_earth * cosine - s_earth * sine, s_earth * cosine + c_earth * sine]),
        memory=memory,
        time=state.time + period,
        first_signal=jnp.where(signal, jnp.minimum(state.first_signal, state.time), state.first_signal),
        first_capture=jnp.where(begins, jnp.minimum(state.first_capture, state.time), state.first_capture),
        last_capture=jnp.where(begins, state.time, state.last_capture),
        captures=state.captures + jnp.where(begins, 1.0, 0.0),
    )
    nadir = -(state.up @ dcm)
    error = angle_between(nadir, jnp.array([0.0, 0.0, 1.0]))
    sample = Sample(
        nadir_body=nadir,
        present=seen.signals.present,
        first=seen.first,
        inside=seen.inside,
        mode=memory.mode,
        direction=memory.direction,
        angular_velocity=w,
        error=error,
        azimuths=seen.azimuths,
        sun_body=scene.sun @ dcm,
        moon_body=scene.moon @ dcm,
    )
    return after, sample


def turn_quaternion(rotation: Float[Array, "3"]) -> Float[Array, "4"]:
    """Quaternion of a rotation by its series, to 1e-13 for half a turn: sine and cosine are called case by case."""
    square = 0.25 * jnp.sum(rotation * rotation)
    cosine, sinc = jnp.ones_like(square), jnp.ones_like(square)
    for n in range(18, 0, -2):
        cosine = 1.0 - square / (n * (n - 1)) * cosine
        sinc = 1.0 - square / (n * (n + 1)) * sinc
    return jnp.concatenate([cosine[None], 0.5 * sinc * rotation])
