"""Many satellites on one orbit at once."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.dynamics import AttitudeState
from jaxsat.math import quaternion
from jaxsat.simulate.batch import Batch, trajectory
from jaxsat.simulate.checks import (
    check_numbers,
    check_satellite,
    check_surroundings,
    check_tolerance,
    sound_cases,
    with_unit_length,
)
from jaxsat.simulate.on_grid import Trajectory
from jaxsat.simulate.single import MOST_STEPS, Tabulate
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
) -> Trajectory:
    """Motions of many cases from `initial`, leaves over the cases, at monotonic `times` [s]: [cases, samples, ...].

    `spacecraft` is shared, or its leaves are over the cases too; the torques are by default those of its parts. The
    method is Adams of order 12, for torques without kinks; with a `rod_lag` in the state RK4, which goes across the
    turns of hysteresis rods. The step is the one with which a pilot chunk, half of it the fastest cases, agrees
    with steps 1.5 times as long within a third of `tolerance` [rad]; `error` of the result is the pilot's. With
    `max_step` [s] it is given and not checked. A case that cannot be moved, for its state or its own satellite, or
    whose motion is not finite, is NaN and listed in `diverged`; the others are as they are without it.
    Raises ValueError as `simulate` does for what is common to all.
    """
    varies = spacecraft.inertia.ndim == 3
    if max_step is None:
        check_tolerance(tolerance, "simulate_many")
    if not varies:
        check_satellite(spacecraft, "simulate_many")
    check_numbers(torques, "simulate_many: torques")
    times = np.asarray(times, float)
    check_surroundings(surroundings, start, times, "simulate_many")
    cases, kept = initial.quaternion.shape[0], np.flatnonzero(sound_cases(spacecraft, initial, satellite_varies=varies))
    axes, spacecraft, initial = _in_principal_axes(spacecraft, with_unit_length(initial), torques)
    batch, error = Batch(spacecraft, initial, surroundings, times, float(start), torques, chunk).of(kept), None
    if max_step is None:
        rates = batch.rates()
        # A rate that no step follows would make all others wait for it.
        followed = rates * np.abs(times - start).max(initial=0.0) < MOST_STEPS * batch.first_reach(tolerance)
        batch, kept = batch.of(np.flatnonzero(followed)), kept[followed]
        if kept.size:
            max_step, error = batch.step_within(tolerance, rates[followed])
    parts = sum(leaf.shape[-1] for leaf in jax.tree.leaves(initial))
    found = np.full((cases, len(times), parts), np.nan, initial.quaternion.dtype)
    if kept.size and max_step is not None:
        found[kept] = batch.run(np.arange(kept.size), max_step)
    motion = trajectory(found, error)
    return motion if axes is None else _in_body_axes(motion, axes)


def _in_principal_axes(spacecraft, initial, torques):
    """dcm_principal_from_body and satellite and states in those axes, where that spares work; else None.

    Half of the right-hand side is products with the inertia's off-diagonal elements. A torque with vectors of its own
    would have to be turned too, and so would a part that is not known here.
    """
    own_vectors = bool(spacecraft.parts) or any(jnp.ndim(leaf) > 0 for leaf in jax.tree.leaves(torques))
    inertia = np.asarray(spacecraft.inertia)
    if own_vectors or inertia.ndim == 3 or np.count_nonzero(inertia - np.diag(np.diag(inertia))) == 0:
        return None, spacecraft, initial
    moments, columns = np.linalg.eigh(inertia.astype(float))
    axes = columns.T * np.array([np.sign(np.linalg.det(columns)), 1.0, 1.0])[:, None]
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
