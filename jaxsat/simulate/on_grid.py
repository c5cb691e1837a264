"""Attitude motion over a grid that is given."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsat.dynamics import AttitudeState, RigidBody, derivative, rigid_body
from jaxsat.environment import OrbitTable
from jaxsat.integrators import RK4, AdamsGrid, StepGrid, Tableau, integrate, integrate_blocks, tableau_step
from jaxsat.math import quaternion
from jaxsat.math.sample_read import read_samples
from jaxsat.simulate.parts import advance_parts, parts_of
from jaxsat.simulate.turns import past_turns, rod_fields
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque


class Trajectory(eqx.Module):
    """Attitude motion at the requested times."""

    quaternion: Float[Array, "*cases samples 4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "*cases samples 3"]
    """Body axes [rad/s]."""
    rod_lag: Float[Array, "*cases samples rods"] | None = None
    """State of the hysteresis rods, where there are any."""
    rod_heat: Float[Array, "*cases samples rods"] | None = None
    """Energy that the field's changes have put into each rod since the start, volume times the integral of H dB [J].

    Over whole loops all of it is heat, taken from the motion; on the way the rod holds a part that it gives back.
    """
    grid: StepGrid | AdamsGrid | None = None
    """The steps taken; a fit or a derivative may go over them again (`simulate_on_grid`)."""
    error: float | None = eqx.field(static=True, default=None)
    """Largest angle to the same motion with steps 1.5 times as long [rad]: more than the error of a smooth motion."""
    errors: Float[Array, " cases"] | None = None
    """The same of each case that has steps of its own; `error` is then the largest within the tolerance."""
    unresolved: tuple[int, ...] = eqx.field(static=True, default=())
    """Cases whose error is above the tolerance, whatever the steps: their motion is chaotic."""
    diverged: tuple[int, ...] = eqx.field(static=True, default=())
    """Cases whose motion is not finite."""


def simulate_on_grid(
    spacecraft: Spacecraft,
    initial: AttitudeState,
    table: OrbitTable,
    grid: StepGrid | AdamsGrid,
    *,
    torques: tuple[AbstractTorque, ...] | None = None,
    tableau: Tableau = RK4,
    blocks: Int[Array | np.ndarray, ""] | None = None,
    checkpoint_every: int | None = None,
) -> Trajectory:
    """Motion from `initial` at the grid's start, at the times the grid was laid through; may be traced.

    `table` is the orbit at `grid.node_times`; the torques are by default those of the satellite's parts. The grid tells
    the method: Adams of order 12, or the Runge-Kutta method of `tableau`, for which the grid was laid, with the
    quaternion renormalised after each step. On an Adams grid `initial` may be of many cases, their axis in front, which
    is several times as fast as `jax.vmap`, forward and in derivatives. With `blocks` only that many blocks of
    Runge-Kutta steps are taken (forward-mode derivatives only) and later samples are meaningless; `checkpoint_every` is
    the reverse mode's economy (`jaxsat.integrators.integrate`).
    """
    body = rigid_body(spacecraft, torques)
    if isinstance(grid, AdamsGrid):
        if blocks is not None or checkpoint_every is not None:
            raise ValueError("simulate_on_grid: blocks and checkpoint_every are for Runge-Kutta grids")
        return by_adams(initial, body, table, grid)

    def step(state, h, points):
        return attitude_step(body, tableau, state, h, points)

    lengths = jnp.asarray(grid.step)
    if blocks is None:
        states = integrate(step, initial, table, lengths, checkpoint_every=checkpoint_every)
        itself = np.ones((len(grid.sample_index), 1))
        at_samples = jax.tree.map(lambda a: read_samples(a, grid.sample_index, itself), states)
    else:
        at_samples = integrate_blocks(step, initial, table, lengths, blocks, grid.sample_index)
    return Trajectory(at_samples.quaternion, at_samples.angular_velocity, at_samples.rod_lag, grid=grid)


def by_adams(
    initial: AttitudeState,
    body: RigidBody,
    table: OrbitTable,
    grid: AdamsGrid,
    *,
    count: Int[Array | np.ndarray, ""] | None = None,
) -> Trajectory:
    """`simulate_on_grid` for an Adams grid; `count` as in `integrate_adams`."""
    many = initial.quaternion.ndim == 2
    cases_last = jax.tree.map(lambda x: jnp.moveaxis(x, 0, -1), initial) if many else initial
    like = jax.tree.map(lambda x: x[0], initial) if many else initial
    at_end = count is None and grid.at_end
    states = advance_parts(parts_of(cases_last), like, body, table, grid, count=count, last_only=at_end)
    states = jnp.moveaxis(states, -1, 0) if many else states
    lag = None if initial.rod_lag is None else states[..., 7:]
    return Trajectory(quaternion.normalize(states[..., :4]), states[..., 4:7], lag, grid=grid)


def attitude_step(
    body: RigidBody, tableau: Tableau, state: AttitudeState, h: Float[Array, ""], points: tuple[OrbitTable, ...]
) -> AttitudeState:
    """One step of the attitude, with the quaternion brought back to unit length.

    Rods with hysteresis go through it on the branch on which they begin; where their field turns on the way, the end
    is brought to where the turn leads (`past_turns`).
    """
    points = (*points[:-1], points[-1].at_end())
    before = None if state.rod_lag is None else rod_fields(state, points[0], body)
    rising = None if before is None else before.rate >= 0.0
    state = tableau_step(tableau, lambda y, point: derivative(y, point, body, rising=rising), state, h, points)
    state = dataclasses.replace(state, quaternion=quaternion.normalize(state.quaternion))
    return state if before is None else past_turns(state, h, before, points[-1], body)


def trajectory(states: Float[np.ndarray, "cases samples parts"], error: float | None, rods: int) -> Trajectory:
    """Of components at the requested times, with lag and heat of so many rods.

    A case that is not finite is NaN and listed in `diverged`.
    """
    q = states[..., :4]
    with np.errstate(all="ignore"):
        length = np.linalg.norm(q, axis=-1, keepdims=True)
        unit = q / length
    # A motion thrown out by unstable steps may still be finite: its quaternion is not of unit length.
    finite = np.isfinite(states).all(axis=(1, 2)) & np.all(np.abs(length - 1.0) < 0.5, axis=(1, 2))
    return Trajectory(
        quaternion=jnp.asarray(np.where(finite[:, None, None], unit, np.nan)),
        angular_velocity=jnp.asarray(states[..., 4:7]),
        rod_lag=jnp.asarray(states[..., 7 : 7 + rods]) if rods else None,
        rod_heat=jnp.asarray(states[..., 7 + rods :]) if rods else None,
        error=error,
        diverged=tuple(np.flatnonzero(~finite).tolist()),
    )
