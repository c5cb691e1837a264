"""A closed loop of any satellite as one function of plant, estimator, controller and schedule."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.control.actuators import fire, motor_torques, torquer_dipoles
from jaxsat.control.closed_loop import ClosedLoop
from jaxsat.control.loops.controllers import AbstractController
from jaxsat.control.loops.estimators import AbstractEstimator, Now
from jaxsat.control.loops.readings import AbstractChannel, nothing_yet, numbers_needed, read
from jaxsat.control.loops.samples import Sample
from jaxsat.control.loops.schedule import Schedule
from jaxsat.control.loops.timeline import Stage, Timeline
from jaxsat.control.loops.vehicle import Motion, Vehicle, motion_rates, moved
from jaxsat.control.loops.watches import AbstractWatch


class Plant(eqx.Module):
    """What is controlled: the satellite with its actuators, its sensors, and what surrounds it."""

    vehicle: Vehicle
    channels: Mapping[str, AbstractChannel]
    """Its sensors by what they see."""
    timeline: Timeline


class LoopState(eqx.Module):
    """One case: what moves, what is remembered, and what is switched on."""

    motion: Motion
    late: dict[str, Any]
    """What the channels remember: readings under way."""
    estimator: Any
    controller: Any
    dipoles: Float[Array, " torquers"] | None
    """Of the torquers while they are on [A m^2]."""
    motors: Float[Array, " wheels"] | None
    """Torque of each motor on its wheel [N m]."""
    thrust: Float[Array, "3"] | None
    """Mean torque of the thrusters, body axes [N m]."""
    tally: Any


def loop(
    plant: Plant,
    estimator: AbstractEstimator,
    controller: AbstractController,
    schedule: Schedule,
    *,
    watch: AbstractWatch | None = None,
    noisy: bool = True,
) -> ClosedLoop:
    """The closed loop: in each control period read, estimate, decide, then move in steps of RK4.

    For `run_cases` and `run_one` with `fixed` = (vehicle, channels, estimator, controller), each of one case or with
    the cases in front, and a `first_state`. The objects given here say what there is, and their numbers are those of
    one case. Between the readings the motion takes the steps of the schedule with the surroundings of the plant's
    timeline at their stages; dipoles and motor torques are constant from one switch to the next. Pulses of thrusters
    count as their mean over the period, which moves the attitude by an eighth of their acceleration times the period
    squared at most.
    """
    fixed = (plant.vehicle, plant.channels, estimator, controller)
    like = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(jnp.shape(leaf), jnp.result_type(leaf)), fixed)
    normals, uniforms = numbers_needed(plant.channels)

    def random(key):
        if not uniforms:
            return jax.random.normal(key, (normals,))
        normal, uniform = jax.random.split(key)
        return jnp.concatenate([jax.random.normal(normal, (normals,)), jax.random.uniform(uniform, (uniforms,))])

    def period(vehicle, channels, estimator, controller, state, numbers, here):
        return _decided(vehicle, channels, estimator, controller, watch, schedule.period_s, state, numbers, here)

    def move(vehicle, channels, estimator, controller, state, stage):
        return _moved(vehicle, state, stage)

    return ClosedLoop(
        period,
        like,
        random if noisy and normals + uniforms else None,
        move=move,
        rows=plant.timeline.instants,
        nodes=plant.timeline.stages,
    )


def first_state(
    plant: Plant,
    estimator: AbstractEstimator,
    controller: AbstractController,
    motion: Motion,
    *,
    watch: AbstractWatch | None = None,
) -> LoopState:
    """One case before its first control period: nothing read, nothing switched on."""
    torquers, wheels = plant.vehicle.torquers, plant.vehicle.wheels
    return LoopState(
        motion=motion,
        late=nothing_yet(plant.channels),
        estimator=estimator.start(),
        controller=controller.start(),
        dipoles=None if torquers is None else jnp.zeros(torquers.max_dipole.shape[-1]),
        motors=None if wheels is None else jnp.zeros(wheels.inertia.shape[-1]),
        thrust=None if plant.vehicle.thrusters is None else jnp.zeros(3),
        tally=None if watch is None else watch.start(),
    )


def _decided(vehicle, channels, estimator, controller, watch, period, state, numbers, here):
    """The state with new commands, and the sample of the period."""
    motion = state.motion
    late, readings = read(channels, state.late, motion, here, numbers)
    late, readings = jax.lax.optimization_barrier((late, readings))
    now = Now(here, jnp.asarray(period), motion)
    memory, estimate = estimator.update(state.estimator, readings, now)
    decision, commands = controller.update(state.controller, estimate, now)
    commands = jax.lax.optimization_barrier(commands)
    dipoles = motors = pulses = None
    if vehicle.torquers is not None:
        dipoles = torquer_dipoles(vehicle.torquers, commands.dipole)
    if vehicle.wheels is not None:
        motors = motor_torques(vehicle.wheels, commands.torque, motion.wheel_speed, period)
    if vehicle.thrusters is not None:
        wanted = jnp.zeros(3) if commands.thrust is None else commands.thrust
        silent = jnp.zeros(vehicle.thrusters.torque.shape) if commands.dead_band is None else commands.dead_band
        pulses = jax.lax.optimization_barrier(fire(vehicle.thrusters, wanted, silent, period))
    most = None if vehicle.torquers is None else vehicle.torquers.max_dipole
    sample = Sample(motion, readings, estimate, dipoles, motors, pulses, decision, max_dipoles=most)
    tally = None if watch is None else watch.update(state.tally, sample, here)
    thrust = None if pulses is None else pulses.torque_body
    return LoopState(motion, late, memory, decision, dipoles, motors, thrust, tally), sample


def _moved(vehicle: Vehicle, state: LoopState, stage: Stage) -> LoopState:
    """One step of the motion."""
    dipole = jnp.zeros(3)
    if vehicle.torquers is not None and state.dipoles is not None:
        left = stage.on + (1.0 - stage.on) * vehicle.torquers.residual
        dipole = vehicle.torquers.dipole(left * state.dipoles)
    begin, middle, end = (jax.tree.map(lambda leaf, k=k: leaf[k], stage.points) for k in range(3))

    def slope(motion, point, rising=None):
        motion = jax.lax.optimization_barrier(motion)
        return jax.lax.optimization_barrier(
            motion_rates(vehicle, motion, point, dipole, state.motors, state.thrust, rising)
        )

    return dataclasses.replace(state, motion=moved(slope, state.motion, stage.length, (begin, middle, end), vehicle))
