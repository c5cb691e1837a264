"""The closed loop of the Earth search: sky, sensors, automaton, rates that follow with lag, attitude and orbit."""

import math
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.control.earth_search.law import TRACK, EarthSearchLaw, SearchMemory, decide, first_memory
from jaxsat.control.earth_search.sensing import EarthScene, Inside, SunChoice, sense
from jaxsat.control.earth_search.vehicle import EarthSearchCraft, search_craft
from jaxsat.environment.albedo.infrared import BrightnessMap
from jaxsat.math import angle_between, quaternion
from jaxsat.math.case_scan import scan_cases
from jaxsat.math.scalars import elements


@dataclass(frozen=True)
class SearchSettings:
    """What is fixed for all cases of a program."""

    period_s: float = 4.0
    inside: Inside = "brightness"
    sun: SunChoice = "blocked"
    moon: bool = True


class SearchCases(eqx.Module):
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
    craft: EarthSearchCraft
    """Leaves with the cases in front, or without where they are common to all."""
    key: Key[Array, " cases"]


class SearchState(eqx.Module):
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


class SearchSample(eqx.Module):
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


def first_state(law: EarthSearchLaw, q, w, up, along, greenwich) -> SearchState:
    """At the start of a case."""
    zero, never = jnp.asarray(0.0), jnp.asarray(jnp.inf)
    angle = jnp.stack([jnp.cos(greenwich), jnp.sin(greenwich)])
    return SearchState(q, w, up, along, angle, first_memory(law), zero, never, never, never, zero)


def one_step(
    settings: SearchSettings,
    law: EarthSearchLaw,
    field: BrightnessMap | None,
    craft: EarthSearchCraft,
    scene: EarthScene,
    orbit_turn: Float[Array, "2"],
    state: SearchState,
    coin: Float[Array, "4"],
) -> tuple[SearchState, SearchSample]:
    """One case one period on: look, decide, turn. `orbit_turn` is cosine and sine of the orbit's turn in a period."""
    hold, period = jax.lax.optimization_barrier, settings.period_s
    dcm = hold(quaternion.to_dcm(state.quaternion))
    seen = hold(
        sense(
            craft,
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
    limit = craft.acceleration * period
    new_w = hold(w + jnp.clip((1.0 - jnp.exp(-period / craft.lag)) * (wanted - w), -limit, limit))
    turn = hold(turn_quaternion(0.5 * period * (w + new_w)))
    q = hold(quaternion.multiply(state.quaternion, turn))
    # A step of Newton's towards norm one suffices: it was one a step ago.
    q = q * (1.5 - 0.5 * jnp.sum(q * q))
    c, s = orbit_turn
    cosine, sine = state.greenwich
    c_earth, s_earth = (f(EARTH_ROTATION_RATE * period) for f in (math.cos, math.sin))

    begins = (memory.mode == TRACK) & (state.memory.mode != TRACK)
    signal = jnp.any(seen.signals.present)
    after = SearchState(
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
    sample = SearchSample(
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


def orbit_turn(orbital_rate: Float[Array, "*n"], settings: SearchSettings) -> Float[Array, "*n 2"]:
    """Cosine and sine of the orbit's turn in a period."""
    angle = orbital_rate * settings.period_s
    return jnp.stack([jnp.cos(angle), jnp.sin(angle)], axis=-1)


def run_cases(
    settings: SearchSettings, law: EarthSearchLaw, cases: SearchCases, steps: int, field: BrightnessMap | None
) -> SearchState:
    """The state of every case after a number of steps; leaves with the cases in front."""
    fixed = (cases.craft, cases.scene, orbit_turn(cases.orbital_rate, settings))
    like = (jax.eval_shape(search_craft), *jax.tree.map(_alone, fixed[1:]))

    def step(law, craft, scene, turn, state, *coin):
        coin = coin[0] if coin else jnp.zeros(4)
        return one_step(settings, law, field, craft, scene, turn, state, coin)[0]

    def coins(number):
        drawn = jax.vmap(lambda key: jax.random.uniform(jax.random.fold_in(key, number), (4,)))(cases.key)
        return (elements(drawn.T, element_rank=1),)

    start = jax.vmap(lambda *motion: first_state(law, *motion))(*_motion(cases))
    given = (law, *fixed), (jax.eval_shape(lambda: law), *like)
    if settings.inside != "random":
        return scan_cases(step, *given, start, steps)
    shape = jax.ShapeDtypeStruct((4,), cases.up.dtype)
    return scan_cases(step, *given, start, steps, drawn=coins, drawn_like=(shape,))


def run_one(
    settings: SearchSettings, law: EarthSearchLaw, case: SearchCases, steps: int, field: BrightnessMap | None
) -> tuple[SearchState, SearchSample]:
    """Final state and history [steps ...] of a single case, `SearchCases` of one."""
    sound = jax.eval_shape(search_craft)
    craft = jax.tree.map(lambda leaf, one: leaf[0] if leaf.ndim > len(one.shape) else leaf, case.craft, sound)
    scene = jax.tree.map(lambda leaf: leaf[0], case.scene)
    start = first_state(law, *(leaf[0] for leaf in _motion(case)))
    turn = orbit_turn(case.orbital_rate[0], settings)

    def advance(state, number):
        coin = jax.random.uniform(jax.random.fold_in(case.key[0], number), (4,))
        return one_step(settings, law, field, craft, scene, turn, state, coin)

    return jax.lax.scan(advance, start, jnp.arange(steps))


def _motion(cases):
    return cases.quaternion, cases.angular_velocity, cases.up, cases.along, cases.greenwich


def _alone(leaf):
    return jax.ShapeDtypeStruct(leaf.shape[1:], leaf.dtype)


def time_steps(seconds: float, settings: SearchSettings) -> int:
    """Steps that fill a time [s]."""
    return math.ceil(seconds / settings.period_s)
