"""Cases of a closed loop of any satellite: drawn, run many at once, or one with its history."""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Key

from jaxsat.control import closed_loop
from jaxsat.control.actuators import Magnetorquers, ReactionWheels, Thrusters
from jaxsat.control.loops import (
    AbstractController,
    AbstractEstimator,
    AbstractWatch,
    Channel,
    Instant,
    LoopState,
    Motion,
    Plant,
    Sample,
    Schedule,
    Timeline,
    Vehicle,
    first_state,
    loop,
    vehicle,
)
from jaxsat.control.loops.vehicle import inverse_without_wheels, own_parts
from jaxsat.math.one_function import first_that_compiles, in_one_function
from jaxsat.satellites.model import Model
from jaxsat.simulate.lane_loop import WIDE
from jaxsat.sweep.flights.flight import Flight
from jaxsat.sweep.flights.inputs import start_inputs
from jaxsat.sweep.flights.spread import Spread, drawn_model
from jaxsat.sweep.flights.starts import first_lag
from jaxsat.sweep.history import History
from jaxsat.sweep.knobs.turns import Turn, turned
from jaxsat.sweep.scenario import Metric, Scenario, case_keys, number_of

Start = Callable[[Key[Array, ""]], tuple[Float[Array, "4"], Float[Array, "3"]]]
"""Attitude and rate of a case at t = 0 by its key."""


class Drawn(eqx.Module):
    """Cases as they begin; leaves with the cases in front, or common to all."""

    motion: Motion
    vehicle: Vehicle
    channels: dict[str, Channel]
    numbers: Float[Array, "cases leaves"]
    """Of the satellite file, SI."""
    key: Key[Array, " cases"]
    """Of the noise."""


class Fixed(NamedTuple):
    """What does not change in a case: where the turns of a loop find their leaves."""

    vehicle: Vehicle
    channels: Mapping[str, Channel]
    estimator: AbstractEstimator
    controller: AbstractController


@dataclass(frozen=True)
class LoopCases:
    """A closed loop and what its cases are drawn from."""

    flight: Flight
    spread: Spread
    channels: Mapping[str, Channel]
    names: Mapping[str, str]
    """Of the sensors in the satellite file."""
    torquers: Magnetorquers | None
    wheels: ReactionWheels | None
    estimator: AbstractEstimator
    controller: AbstractController
    schedule: Schedule
    watch: AbstractWatch
    start: Start
    timeline: Callable[[], Timeline]
    """Tabulated when it is first asked for."""
    duration_s: float
    """Simulated time of a case."""
    noisy: bool = True
    thrusters: Thrusters | None = None
    turns: tuple[Turn, ...] = ()
    """Knobs, with their leaves in a `Fixed`. The vehicle's inverse of the inertia follows by itself."""

    @functools.cached_property
    def nominal(self) -> Vehicle:
        """The vehicle of the file's own numbers."""
        # Kept for chunks of any size, so it must not belong to the trace that asks for it first.
        with jax.ensure_compile_time_eval():
            return vehicle(self.flight.satellite.model.spacecraft, self.torquers, self.wheels, self.thrusters)

    @property
    def periods(self) -> int:
        """Control periods of a case."""
        return len(self.timeline().instants.time)

    def draw(self, seed: int, cases: np.ndarray) -> Drawn:
        """Cases by their numbers."""
        return self._draw(case_keys(seed, cases))

    def run(self, drawn: Drawn) -> LoopState:
        """Their states at the end."""
        return self._run(self.timeline(), drawn)

    def run_moved(self, drawn: Drawn, moved: Float[Array, "cases knobs"]) -> LoopState:
        """The same with the knobs of each case moved. Differentiable by `moved`."""
        return self._run_moved(self.timeline(), drawn, moved)

    def history(self, drawn: Drawn, number: int = 0) -> tuple[LoopState, Sample]:
        """State at the end and samples [periods ...] of one of them."""
        return self._history(self.timeline(), drawn, number)

    @functools.cached_property
    def _draw(self):
        model = self.flight.satellite.model
        rods = model.spacecraft.hysteresis_rods is not None
        field = np.asarray(self.timeline().instants.b_field_eci[0]) if rods else None

        def draw(keys):
            q, w, spread, noise = jax.vmap(self._begin)(keys)
            changed, numbers = drawn_model(self.spread, model, spread)
            speed = None if self.wheels is None else jnp.zeros((len(keys), len(self.wheels.inertia)))
            own = self._vehicles(changed)
            channels = {
                sight: eqx.tree_at(lambda c: c.sensor, one, changed.sensors[self.names[sight]])
                if sight in self.names
                else one
                for sight, one in self.channels.items()
            }
            lag = None if field is None else first_lag(changed.spacecraft, model.spacecraft, q, field)
            return Drawn(Motion(q, w, speed, lag), own, channels, numbers, noise)

        return jax.jit(draw)

    def _begin(self, key):
        start, spread, noise = jax.random.split(key, 3)
        return *self.start(start), spread, noise

    def _vehicles(self, model: Model) -> Vehicle:
        """The nominal vehicle with the spacecraft of the cases."""
        craft, nominal = model.spacecraft, self.nominal
        craft = dataclasses.replace(craft, parts=own_parts(craft.parts))
        inverse = nominal.inverse_inertia
        if craft.inertia.ndim == 3:
            inverse = jax.vmap(lambda inertia: inverse_without_wheels(inertia, self.wheels))(craft.inertia)
        return dataclasses.replace(nominal, spacecraft=craft, inverse_inertia=inverse)

    def _plant(self, around: Timeline) -> Plant:
        return Plant(self.nominal, self.channels, around)

    def _loop(self, around: Timeline):
        given = (self._plant(around), self.estimator, self.controller, self.schedule)
        return loop(*given, watch=self.watch, noisy=self.noisy)

    def _first(self, around: Timeline, motion: Motion) -> LoopState:
        return first_state(self._plant(around), self.estimator, self.controller, motion, watch=self.watch)

    @functools.cached_property
    def _run(self):
        def run(around, drawn):
            return self._ended(around, drawn, Fixed(drawn.vehicle, drawn.channels, self.estimator, self.controller))

        return self._compiled(run)

    @functools.cached_property
    def _run_moved(self):
        def run(around, drawn, moved):
            like = Fixed(self.nominal, self.channels, self.estimator, self.controller)
            fixed = turned(like._replace(vehicle=drawn.vehicle, channels=drawn.channels), like, self.turns, moved)
            inertia = fixed.vehicle.spacecraft.inertia
            if inertia.ndim == 3:
                inverse = jax.vmap(lambda inertia: inverse_without_wheels(inertia, self.wheels))(inertia)
                fixed = eqx.tree_at(lambda f: f.vehicle.inverse_inertia, fixed, inverse)
            return self._ended(around, drawn, fixed)

        return self._compiled(run)

    def _ended(self, around: Timeline, drawn: Drawn, fixed: Fixed) -> LoopState:
        start = jax.vmap(functools.partial(self._first, around))(drawn.motion)
        return closed_loop.run_cases(self._loop(around), fixed, start, drawn.key, _count(around))

    def _compiled(self, run: Callable[..., LoopState]) -> Callable[..., LoopState]:
        plain = jax.jit(run, compiler_options=WIDE)
        if self.estimator.calls_libraries:
            return plain
        return first_that_compiles(jax.jit(in_one_function(run), compiler_options=WIDE), plain)

    @functools.cached_property
    def _history(self):
        @jax.jit
        def alone(around, drawn, number):
            motion = jax.tree.map(lambda leaf: leaf[number], drawn.motion)
            fixed = (drawn.vehicle, drawn.channels, self.estimator, self.controller)
            start = self._first(around, motion)
            made = self._loop(around)
            return closed_loop.run_one(made, fixed, start, drawn.key[number], _count(around), number=number)

        return alone


Chosen = tuple[tuple[str, str], ...]
"""All options of a scenario and their values."""
Metrics = Callable[[LoopState, Instant], Mapping[str, Array]]
"""Status and metrics of states at the end, and what is there then."""


def loop_scenario(
    program: Callable[[Chosen], tuple[LoopCases, Metrics]],
    options: Mapping[str, str],
    history: Callable[[Chosen, int, int], History],
    *,
    name: str,
    statuses: tuple[str, ...],
    metrics: Mapping[str, Metric],
    chunk: int,
    max_rate: str,
) -> Scenario:
    """The scenario of a closed loop: `program` makes its cases and metrics of the options, and keeps them.

    `max_rate` is the option of the largest rate at the start. Whatever is wrong with options and files is said before
    anything is compiled.
    """
    chosen = tuple(options.items())
    cases, _ = program(chosen)

    def run(seed: int, numbers: np.ndarray) -> dict[str, np.ndarray]:
        cases, of_end = program(chosen)
        return jax.device_get(of_end(cases.run(cases.draw(seed, numbers)), cases.timeline().last))

    def run_moved(seed: int, numbers: np.ndarray, moved: Any) -> Mapping[str, Array]:
        cases, of_end = program(chosen)
        return of_end(cases.run_moved(cases.draw(seed, numbers), jnp.asarray(moved)), cases.timeline().last)

    def draw(seed: int, numbers: np.ndarray) -> Drawn:
        return jax.device_get(program(chosen)[0].draw(seed, numbers))

    inputs = (*start_inputs(number_of(options, max_rate)), *cases.spread.inputs())
    told = functools.partial(history, chosen)
    return Scenario(
        name,
        statuses,
        metrics,
        chunk,
        run,
        history=told,
        inputs=inputs,
        draw=draw,
        knobs=tuple(turn.knob for turn in cases.turns),
        run_moved=run_moved,
        horizon_s=cases.duration_s,
    )


def ended(good: Bool[Array, " cases"], sound: Bool[Array, " cases"], metrics: Mapping[str, Array]) -> dict[str, Array]:
    """Status and metrics: 0 where a case is good, 1 where not; 2 and nothing else where its numbers are not sound."""
    found = {name: jnp.where(sound, value, jnp.nan) for name, value in metrics.items()}
    return {"status": jnp.where(sound, jnp.where(good, 0, 1), 2), **found}


def _count(around: Timeline) -> int:
    return around.instants.time.shape[0]
