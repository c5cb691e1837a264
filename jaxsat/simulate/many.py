"""Many satellites on one orbit at once."""

import dataclasses
import warnings

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.dynamics import AttitudeState
from jaxsat.math import quaternion
from jaxsat.simulate.batch import Batch
from jaxsat.simulate.checks import (
    check_numbers,
    check_precision,
    check_satellite,
    check_shapes,
    check_surroundings,
    check_times,
    check_tolerance,
    sound_cases,
    with_unit_length,
)
from jaxsat.simulate.on_grid import Trajectory, trajectory
from jaxsat.simulate.principal import common_axes
from jaxsat.simulate.single import MOST_STEPS
from jaxsat.simulate.tabulating import Tabulate
from jaxsat.spacecraft import Spacecraft, in_axes
from jaxsat.torques import AbstractTorque


def simulate_many(
    spacecraft: Spacecraft,
    initial: AttitudeState,
    surroundings: Tabulate,
    times: np.ndarray,
    *,
    start: float = 0.0,
    torques: tuple[AbstractTorque, ...] | None = None,
    tolerance: float = 1e-6,
    max_step: float | None = None,
    chunk: int | None = None,
    warn: bool = True,
) -> Trajectory:
    """Motions of many cases from `initial`, leaves over the cases, at monotonic `times` [s]: [cases, samples, ...].

    `spacecraft` is shared, or its leaves are over the cases too; the torques are by default those of its parts. The
    method is Adams of order 12, for torques without kinks. The step is the one with which a pilot chunk, half of it the
    fastest cases, agrees with steps 1.5 times as long within a third of `tolerance` [rad]; `error` of the result is the
    pilot's. With a `rod_lag` in the state each case has steps of its own, which end where the fields along its rods
    turn, and each is compared so: `errors`. A tumbling satellite may be chaotic, so that no step holds the tolerance:
    `unresolved` lists it, and a warning says so unless `warn` is false. With `max_step` [s] the step is given and not
    checked. A case that cannot be moved, for its state or its own satellite, or whose motion is not finite, is NaN and
    listed in `diverged`; the others are as they are without it. States in float32 are refused unless `tolerance` says
    that attitudes may be off by 1e-3 rad or more, with a given step too.
    Raises ValueError as `simulate` does for what is common to all.
    """
    if initial.quaternion.ndim != 2 or not initial.quaternion.size:
        got = np.shape(initial.quaternion)
        raise ValueError(f"simulate_many: initial.quaternion must be of one case or more, [cases, 4], got {got}")
    check_shapes(spacecraft, initial, initial.quaternion.shape[:1], "simulate_many")
    if chunk is not None and not chunk >= 1:
        raise ValueError(f"simulate_many: chunk must be one or more, got {chunk}")
    varies = spacecraft.inertia.ndim == 3
    if max_step is None:
        check_tolerance(tolerance, "simulate_many")
    check_precision(initial, tolerance, "simulate_many")
    if not varies:
        check_satellite(spacecraft, "simulate_many")
    check_numbers(torques, "simulate_many: torques")
    times = check_times(times, start, "simulate_many")
    check_surroundings(surroundings, start, times, "simulate_many")
    cases, kept = initial.quaternion.shape[0], np.flatnonzero(sound_cases(spacecraft, initial, satellite_varies=varies))
    axes, spacecraft, initial = _in_principal_axes(spacecraft, with_unit_length(initial), torques)
    shared = (surroundings, times, float(start), torques, tolerance, chunk)
    batch, error = Batch(spacecraft, initial, *shared).of(kept), None
    if max_step is None:
        rates = batch.rates
        # A rate that no step follows would make all others wait for it.
        followed = rates * np.abs(times - start).max(initial=0.0) < MOST_STEPS * batch.first_reach(tolerance)
        batch, kept = batch.of(np.flatnonzero(followed)), kept[followed]
    found = np.full((cases, len(times), batch.parts), np.nan, initial.quaternion.dtype)
    errors = np.full(cases, np.nan)
    if not (np.any(times != start) or batch.in_lanes):
        # Nothing moves before the first step.
        found[kept], error = (
            np.concatenate([batch.initial.quaternion, batch.initial.angular_velocity], axis=-1)[:, None],
            0.0,
        )
    elif kept.size and max_step is not None:
        found[kept] = batch.run(np.arange(kept.size), max_step)
    elif kept.size and batch.in_lanes:
        found[kept], errors[kept] = batch.lanes_within(tolerance)
    elif kept.size:
        step, error = batch.step_within(tolerance)
        found[kept] = batch.run(np.arange(kept.size), step)
    motion = trajectory(found, error, batch.rods)
    if max_step is None and batch.in_lanes:
        motion = _with_errors(motion, errors, tolerance, warn)
    return motion if axes is None else _in_body_axes(motion, axes)


def _with_errors(motion: Trajectory, errors: np.ndarray, tolerance: float, warn: bool) -> Trajectory:
    """What is known of each case; a motion that cannot be held is told loudly and kept."""
    unresolved = tuple(np.flatnonzero(errors > tolerance).tolist())
    if unresolved and warn:
        warnings.warn(
            f"simulate_many: {len(unresolved)} of {len(errors)} motions are not within {tolerance:g} rad, whatever the "
            "steps: they are chaotic. `unresolved` lists them, `errors` has the error of each",
            stacklevel=3,
        )
    held = errors[errors <= tolerance]
    error = float(held.max()) if held.size else None
    return dataclasses.replace(motion, errors=jnp.asarray(errors), error=error, unresolved=unresolved)


def _in_principal_axes(spacecraft, initial, torques):
    """dcm_principal_from_body and satellite and states in those axes, where that spares work; else None."""
    axes = None if spacecraft.inertia.ndim == 3 else common_axes(spacecraft, torques)
    if axes is None:
        return None, spacecraft, initial
    moments = np.diag(axes @ np.asarray(spacecraft.inertia, float) @ axes.T)
    new = eqx.tree_at(lambda craft: craft.inertia, in_axes(spacecraft, axes), jnp.diag(jnp.asarray(moments)))
    # Back to the satellite's own precision, which the axes must not raise.
    new = jax.tree.map(lambda x, like: x.astype(like.dtype), new, spacecraft)
    return axes, new, _states_in(initial, axes.astype(initial.quaternion.dtype))


def _in_body_axes(motion: Trajectory, axes: np.ndarray) -> Trajectory:
    state = _states_in(
        AttitudeState(motion.quaternion, motion.angular_velocity), axes.T.astype(motion.quaternion.dtype)
    )
    return dataclasses.replace(motion, quaternion=state.quaternion, angular_velocity=state.angular_velocity)


@jax.jit
def _states_in(states, dcm_new_from_old):
    """States over leading axes with the body described in new axes."""
    turn = jnp.broadcast_to(quaternion.from_dcm(dcm_new_from_old.T), states.quaternion.shape)
    w = states.angular_velocity
    # Sums written out: a library's product may round a case differently in other company.
    d = dcm_new_from_old
    rows = [d[i, 0] * w[..., 0] + d[i, 1] * w[..., 1] + d[i, 2] * w[..., 2] for i in range(3)]
    return dataclasses.replace(
        states,
        quaternion=quaternion.multiply(states.quaternion, turn),
        angular_velocity=jnp.stack(rows, axis=-1),
    )
