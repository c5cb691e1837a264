"""Attitude motion at any times within a stated tolerance."""

import dataclasses
import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState, rigid_body
from jaxsat.integrators import DORMAND_PRINCE_8, AdamsGrid, StepGrid, Tableau
from jaxsat.integrators.adams import ORDER, REACH, STABLE
from jaxsat.integrators.grid import BLOCK
from jaxsat.math import quaternion
from jaxsat.math.one_function import whole_or_usual
from jaxsat.simulate.checks import (
    check_numbers,
    check_satellite,
    check_shapes,
    check_surroundings,
    check_table,
    check_times,
    check_tolerance,
    in_unit_length,
)
from jaxsat.simulate.lanes.by_turns import grid_of, move_lanes
from jaxsat.simulate.lanes.course import lay_course
from jaxsat.simulate.on_grid import Trajectory, by_adams, simulate_on_grid, trajectory
from jaxsat.simulate.pieces import most_steps, pieces_of
from jaxsat.simulate.rates import fastest_rate
from jaxsat.simulate.tabulating import Tabulate, bucket, jumps
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque, torques_of

COARSER = 1.5
"""Ratio of the steps of the two runs that are compared."""
ATTEMPTS = 12
TURN_REACH = 1.0
"""`reach` of Dormand-Prince 8 where steps end at turns: half, for tumbling motions make their errors grow."""
UNRESOLVED = 0.1
"""Two runs that are so far apart [rad] do not yet tell how their errors fall."""
MOST_STEPS = 2_000_000


def simulate(
    spacecraft: Spacecraft,
    initial: AttitudeState,
    surroundings: Tabulate,
    times: np.ndarray,
    *,
    start: float = 0.0,
    torques: tuple[AbstractTorque, ...] | None = None,
    tolerance: float = 1e-6,
    tableau: Tableau | None = None,
) -> Trajectory:
    """Motion from `initial` at `start`, at monotonic `times` [s], its attitude within `tolerance` [rad].

    The step is tried from the motion's rate, checked by a second run with longer steps, and shortened until the two
    agree; `error` of the result is their difference. The torques are by default those of the satellite's parts
    (`jaxsat.torques.torques_of`). The method is the Runge-Kutta one of `tableau`; by default Adams of order 12 where
    all torques are smooth, else Dormand-Prince 8, whose steps end where a command of `Surroundings` jumps. To
    differentiate, go over the grid of the result with `simulate_on_grid`. A quaternion may have any length above zero.
    Raises ValueError where the times are not monotonic or beyond the orbit's, where no body has the inertia, where a
    number, the state or its surroundings are not finite, and where no step holds the tolerance: it is below rounding,
    or the motion has kinks that no step resolves.
    """
    check_tolerance(tolerance, "simulate")
    check_shapes(spacecraft, initial, (), "simulate")
    check_satellite(spacecraft, "simulate")
    check_numbers(torques, "simulate: torques")
    initial = in_unit_length(initial, "simulate")
    times = check_times(times, start, "simulate")
    check_surroundings(surroundings, start, times, "simulate")
    if tableau is None and (initial.rod_lag is not None or not _smooth(spacecraft, surroundings, start, torques)):
        tableau = DORMAND_PRINCE_8
    order, reach, stable = (ORDER, REACH, STABLE) if tableau is None else (tableau.order, tableau.reach, math.inf)
    rate, table = _rate(spacecraft, initial, surroundings, np.array([float(start)]))
    check_table(table, "simulate")

    longest = longest_step(times, start, tableau, jumps(surroundings))
    first = first_reach(tolerance, order, reach, stable)
    if initial.rod_lag is not None and tableau is not None:
        first = min(first, first_reach(tolerance, order, TURN_REACH, stable))
        body = rigid_body(spacecraft, torques)
        layout = lay_course(surroundings, times, start, tolerance, "simulate", initial.quaternion.dtype)

        def lanes(reach):
            return _by_turns(initial, body, layout, times, start, tableau, reach, longest)

        _, error, motion = hold(tolerance, first, order, times * float(rate), start * float(rate), lanes)
        return dataclasses.replace(motion, error=error)

    def attempt(step, room):
        given = (spacecraft, initial, surroundings, times, start, torques)
        if tableau is None and np.any(times != start):
            return _adams_at_step(*given, step, room)
        return _at_step(*given, tableau or DORMAND_PRINCE_8, step, room)

    def both(step):
        fine, room = attempt(step, 0)
        # By the same program, though it needs fewer steps.
        return fine, attempt(COARSER * step, room)[0]

    _, error, motion = hold(tolerance, min(first / float(rate), longest / COARSER), order, times, start, both)
    return dataclasses.replace(motion, error=error)


def _by_turns(initial, body, layout, times, start, tableau, reach, longest) -> tuple[Trajectory, Trajectory]:
    """Two lanes of one satellite, the second in longer steps."""
    ratio = np.array([1.0, COARSER])
    moved = move_lanes(
        jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), initial),
        body,
        layout,
        reach=reach * ratio,
        max_step=longest * ratio / COARSER,
        tableau=tableau,
        recorded=True,
    )
    motions = trajectory(moved.states, None, initial.rod_lag.shape[0])
    fine, coarse = (jax.tree.map(lambda leaf, lane=lane: leaf[lane], motions) for lane in (0, 1))
    return dataclasses.replace(fine, grid=grid_of(moved.steps, layout, times, start, tableau)), coarse


def _smooth(spacecraft, surroundings, start, torques) -> bool:
    """Whether no torque has kinks."""
    if torques is None:
        # To the satellite's surface alone it matters what surrounds it, and shapes tell what there is.
        naked = spacecraft.facets is None
        around = None if naked else eqx.filter_eval_shape(surroundings, np.array([float(start)]))
        torques = torques_of(spacecraft, around)
    return all(torque.smooth for torque in torques)


def first_reach(tolerance: float, order: int, reach: float, stable: float) -> float:
    """Step times rate to try first; the method is unstable beyond `stable`."""
    return min(reach * tolerance ** (1.0 / order), stable)


def longest_step(times: np.ndarray, start: float, tableau: Tableau | None, stops: np.ndarray | None = None) -> float:
    """Step of the coarsest grid [s]: a step that the samples force on both runs would tell nothing of the error."""
    span = float(np.max(np.abs(times - start), initial=0.0))
    if span == 0.0:
        return math.inf
    if tableau is None:
        return abs(float(AdamsGrid.through(times, start=start, max_step=span).step))
    grid = StepGrid.through(times, start=start, max_step=span, tableau=tableau, stops=stops)
    return float(np.max(np.abs(grid.step)))


def hold(tolerance, first_step, order, times, start, pair):
    """Step, error and result of the first attempt that agrees within `tolerance` with one of 1.5 times its step.

    `pair(step)` returns both, things with a `quaternion`. Raises ValueError where no step does.
    """
    span, best, agreed = float(np.max(np.abs(times - start), initial=0.0)), np.inf, 0.0
    step = min(first_step, max(span, 1e-3))
    stale, tried = 0, False
    for _ in range(ATTEMPTS):
        if span > MOST_STEPS * step:
            break
        tried = True
        fine, coarse = pair(step)
        apart = angles(fine.quaternion, coarse.quaternion)
        error = float(np.max(apart, initial=0.0))
        if error <= tolerance:
            return step, error, fine
        # Where shorter steps do not help, near rounding or at kinks, more of them will not; of a motion that is not
        # resolved yet that cannot be said.
        stale += 0.5 * best < error < UNRESOLVED
        if np.isfinite(error) and (stale == 3 or (stale and error < 1e-9)):
            break
        # But how far into it both runs agree: of a chaotic motion rounding leaves no more to be gained.
        before, agreed = agreed, _agreement(apart, np.abs(times - start), tolerance)
        if error >= UNRESOLVED and 0.0 < agreed < 1.05 * before:
            break
        best = min(best, error)
        # Nor of how fast the error falls.
        shrink = (0.5 * tolerance / error) ** (1.0 / order) if error < UNRESOLVED else 0.5
        step *= max(0.25, shrink)
    told = "no motion was finite" if tried else f"more than {MOST_STEPS} steps would be needed"
    told = f"the best agreement was {best:.1e} rad" if best < np.inf else told
    told += f", within the tolerance for the first {agreed / span:.0%} of the time" if agreed > 0.0 else ""
    raise ValueError(f"no step holds a tolerance of {tolerance:g} rad; {told}")


def _agreement(apart, passed, tolerance) -> float:
    """Time passed [s] at the last sample before which no attitude is farther apart than the tolerance."""
    wrong = np.flatnonzero(np.max(apart.reshape(-1, len(passed)), axis=0) > tolerance)
    return 0.0 if not wrong.size or wrong[0] == 0 else float(passed[wrong[0] - 1])


@eqx.filter_jit
def _rate(spacecraft, initial, surroundings, start):
    table = surroundings(start)
    return fastest_rate(spacecraft, initial, table), table


def angles(p, q) -> np.ndarray:
    """Angles between attitudes [rad]; infinite where one of them is not an attitude: the steps were unstable."""
    lengths = [np.nan_to_num(np.linalg.norm(np.asarray(x), axis=-1)) for x in (p, q)]
    apart = np.asarray(_apart(p, q)) if p.size else np.zeros(p.shape[:-1])
    return np.where(np.minimum(*lengths) > 0.5, apart, np.inf)


@jax.jit
def _apart(p: Float[Array, "*batch 4"], q: Float[Array, "*batch 4"]) -> Float[Array, "*batch"]:
    return quaternion.angle_between(p, q)


def _at_step(spacecraft, initial, surroundings, times, start, torques, tableau, step, room) -> tuple[Trajectory, int]:
    """The motion, and for how many steps its program has room: `room` or more."""
    lay = functools.partial(
        StepGrid.through, times, start=start, max_step=step, tableau=tableau, stops=jumps(surroundings)
    )
    used = lay().step.shape[0]
    # Few shapes, few compilations: the steps' number is rounded up, and the rest is not computed.
    room = max(room, bucket(used))
    motion = _run(spacecraft, initial, surroundings, lay(pad_steps=room), torques, tableau, np.asarray(used // BLOCK))
    return motion, room


def _over_grid(within, spacecraft, initial, surroundings, grid, torques, tableau, blocks):
    grid = jax.tree.map(jnp.asarray, grid)

    def motion(spacecraft, initial, table, grid, blocks):
        return simulate_on_grid(spacecraft, initial, table, grid, torques=torques, tableau=tableau, blocks=blocks)

    # The table is work for vector units and threads.
    return within(motion)(spacecraft, initial, surroundings(grid.node_times), grid, blocks)


_run = whole_or_usual(_over_grid)


def _adams_at_step(spacecraft, initial, surroundings, times, start, torques, step, room) -> tuple[Trajectory, int]:
    pieces = pieces_of(times, start=start, max_step=step, most=most_steps(1), room=room)
    now, states = initial, []
    for piece in pieces:
        motion = _run_adams(spacecraft, now, surroundings, piece.grid, torques, piece.count)
        now = AttitudeState(motion.quaternion[0], motion.angular_velocity[0])
        states.append((np.asarray(motion.quaternion)[piece.read], np.asarray(motion.angular_velocity)[piece.read]))
    q, w = (jnp.asarray(np.concatenate(each)) for each in zip(*states, strict=True))
    # The whole arc's grid, for who goes over it again.
    grid = AdamsGrid.through(times, start=start, max_step=step)
    return Trajectory(q, w, grid=grid), pieces[0].grid.steps


def _over_adams_grid(within, spacecraft, initial, surroundings, grid, torques, count):
    grid = jax.tree.map(jnp.asarray, grid)

    def motion(spacecraft, initial, table, grid, count):
        return by_adams(initial, rigid_body(spacecraft, torques), table, grid, count=count)

    return within(motion)(spacecraft, initial, surroundings(grid.node_times), grid, count)


_run_adams = whole_or_usual(_over_adams_grid)
