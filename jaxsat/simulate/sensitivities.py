"""Derivatives of motions by numbers of one's choice: prepared once, asked often, of one satellite or many."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsat.dynamics import AttitudeState, RigidBody
from jaxsat.integrators import AdamsGrid
from jaxsat.math import inverse_3x3, quaternion
from jaxsat.math.one_function import WIDE, whole_or_usual
from jaxsat.physical import is_of_a_body
from jaxsat.simulate.absent import DUST, arrays_of, nowhere, present
from jaxsat.simulate.batch import Batch, in_chunks, workers
from jaxsat.simulate.checks import (
    check_numbers,
    check_satellite,
    check_surroundings,
    check_table,
    check_times,
    check_tolerance,
    in_unit_length,
    is_known,
    sound_cases,
)
from jaxsat.simulate.on_grid import Trajectory
from jaxsat.simulate.parts import Absent, advance_parts, parts_of
from jaxsat.simulate.principal import common_axes
from jaxsat.simulate.rates import fastest_rate
from jaxsat.simulate.tabulating import Tabulate, bucket, tabulated
from jaxsat.spacecraft import Spacecraft, in_axes
from jaxsat.torques import AbstractTorque

LANES, FEW = 16, 8
"""Satellites side by side, each with all its tangents; and of how few the tangents lie side by side instead."""
GROUPS = 8
"""Of so many satellites in one call, at most."""
FASTER = 1.05
"""Of the rate for which the steps were found, beyond which they are found anew."""


class Derivatives(eqx.Module):
    """Motions at the requested times and their derivatives; the cases in front where there are several."""

    motion: Trajectory
    quaternion: Float[Array | np.ndarray, "*cases samples 4 unknowns"]
    """Of the unit quaternion, by each unknown in its unit."""
    angular_velocity: Float[Array | np.ndarray, "*cases samples 3 unknowns"]
    """[rad/s] by each unknown in its unit."""


class Sensitivities:
    """Motions and their derivatives by `unknowns`, of which `satellite_of` makes a satellite and its state at `start`.

    `satellite_of` takes the unknowns [n] of one satellite and returns its `Spacecraft` and its `AttitudeState`; JAX
    differentiates it. `times` [s] are monotonic; the torques are by default those of the satellite's parts, and have no
    kinks. Derivatives are those of the steps taken, to rounding. The steps are those with which the first motions, or
    faster ones that come later, hold `tolerance` [rad] as `simulate_many` says; with `max_step` [s] they are given and
    not checked. What does not change from call to call, as environment and program, is worked out once. A row of a
    table of unknowns that makes no satellite or no state, or whose motion is not finite, is NaN and listed in
    `motion.diverged`; the others are as they are without it.

    Raises ValueError as `simulate_many` does, for hysteresis rods, for `unknowns` that are not a vector or a table, and
    for a vector of which no body, no attitude or no finite number is made, at each call.
    """

    def __init__(
        self,
        satellite_of: Callable[[Float[Array, " n"]], tuple[Spacecraft, AttitudeState]],
        surroundings: Tabulate,
        times: np.ndarray,
        *,
        start: float = 0.0,
        torques: tuple[AbstractTorque, ...] | None = None,
        tolerance: float = 1e-6,
        max_step: float | None = None,
    ):
        self._of, self._surroundings, self._times = (
            satellite_of,
            surroundings,
            check_times(times, start, "Sensitivities"),
        )
        self._start, self._torques, self._tolerance, self._max_step = float(start), torques, tolerance, max_step
        if max_step is None:
            check_tolerance(tolerance, "Sensitivities")
        if not np.any(self._times != self._start):
            raise ValueError("Sensitivities: times must lead away from `start`, where motions begin")
        check_numbers(torques, "Sensitivities: torques")
        check_surroundings(surroundings, self._start, self._times, "Sensitivities")
        self._axes: np.ndarray | None = None
        self._absent: Absent = ()
        self._rate = 0.0
        self._inputs: tuple = ()
        self._run: Any = None
        self._compiled_for: tuple = ()

    def __call__(self, unknowns: Float[np.ndarray | Array, "*cases n"]) -> Derivatives:
        """Motion and derivatives of one satellite, or of many where `unknowns` is a table with a row for each."""
        x = np.asarray(unknowns, float)
        if x.ndim not in (1, 2) or not x.size:
            raise ValueError(f"Sensitivities: unknowns must be [n] or [cases, n], got an array of shape {x.shape}")
        cases = np.atleast_2d(x)
        sound = np.ones(len(cases), bool)
        if self._run is None:
            sound = sound_cases(*self._made(cases), satellite_varies=True)
        values, slopes = (np.full((len(cases), len(self._times), *rest), np.nan) for rest in ((7,), (7, x.shape[-1])))
        if sound.all():
            values, slopes, sound = self._moved(cases)
        if not sound.all():
            if x.ndim == 1:
                self._refuse(cases)
            if sound.any():
                # In the place of one of which nothing can be made another is moved: the shapes stay.
                values, slopes, _ = self._moved(np.where(sound[:, None], cases, cases[sound][0]))
            values[~sound], slopes[~sound] = np.nan, np.nan
        whole = slice(None) if x.ndim == 2 else 0
        lost = tuple(np.flatnonzero(~np.isfinite(values).all(axis=(1, 2))).tolist())
        values, slopes = values[whole], slopes[whole]
        motion = Trajectory(jnp.asarray(values[..., :4]), jnp.asarray(values[..., 4:]), diverged=lost)
        return Derivatives(motion, slopes[..., :4, :], slopes[..., 4:, :])

    def _moved(self, cases: np.ndarray) -> tuple[np.ndarray, np.ndarray, Bool[np.ndarray, " cases"]]:
        """States, derivatives, and which cases can be; prepared for them where they are not like earlier ones."""
        if self._run is None:
            self._prepare(cases)
        values, slopes, sound, rate, wrong = self._all(cases)
        if sound.all() and (wrong or rate > FASTER * self._rate):
            self._prepare(cases)
            values, slopes, *_ = self._all(cases)
        return values, slopes, sound

    def _all(self, cases: np.ndarray) -> tuple[np.ndarray, np.ndarray, Bool[np.ndarray, " cases"], float, bool]:
        """Of all cases: states [cases samples 7], derivatives [cases samples 7 n], which can be; rate, absent ones."""
        width = 1 if len(cases) < FEW else LANES
        if jax.default_backend() != "cpu":
            width = len(cases)
        groups = min(GROUPS, max(1, -(-len(cases) // (width * workers()))))

        def one(numbers):
            lanes = np.moveaxis(cases[numbers].reshape(groups, width, -1), 1, 2)
            values, slopes, inertia, known, rate, wrong = jax.device_get(self._run(lanes, *self._inputs))
            # [groups samples 7 (n) lanes] to [cases samples 7 (n)].
            values = np.moveaxis(values, -1, 1).reshape(groups * width, *values.shape[1:-1])
            slopes = np.moveaxis(slopes, -1, 1).reshape(groups * width, *slopes.shape[1:-1])
            return values, slopes, known & is_of_a_body(inertia), rate, wrong

        found = in_chunks(one, np.arange(len(cases)), groups * width, (id(self._run), groups, width))
        values, slopes, sound = (np.concatenate([part[k] for part in found])[: len(cases)] for k in (0, 1, 2))
        rate = max(float(np.max(part[3])) for part in found)
        return values, slopes, sound, rate, any(bool(np.any(part[4])) for part in found)

    def _prepare(self, cases: np.ndarray) -> None:
        """Axes, steps, environment and program for unknowns like these."""
        crafts, states = self._made(cases)
        self._axes = common_axes(crafts, self._torques)
        batch = Batch(
            crafts, states, self._surroundings, self._times, self._start, self._torques, self._tolerance, None
        )
        self._rate = np.inf
        step = self._max_step
        if step is None:
            self._rate, step = float(batch.rates.max()), batch.step_within(self._tolerance)[0]
        grid = AdamsGrid.through(self._times, start=self._start, max_step=step)
        count = grid.steps
        grid = grid.padded(bucket(count))
        table = tabulated(self._surroundings, grid.node_times)
        check_table(table, "Sensitivities")
        self._inputs = (table, grid, np.asarray(count))
        self._absent = self._nowhere(cases)
        wanted = self._absent, None if self._axes is None else self._axes.tobytes()
        if self._compiled_for != wanted:
            self._compiled_for, self._run = wanted, whole_or_usual(self._program, WIDE)

    def _made(self, cases: np.ndarray) -> tuple[Spacecraft, AttitudeState]:
        """Satellites and states of all cases, in NumPy."""
        return jax.tree.map(np.asarray, eqx.filter_jit(eqx.filter_vmap(self._checked))(cases))

    def _refuse(self, cases: np.ndarray) -> None:
        """Raise ValueError that says why the first of them cannot be."""
        craft, state = jax.tree.map(lambda leaf: leaf[0], self._made(cases))
        check_satellite(craft, "Sensitivities, case 0")
        in_unit_length(state, "Sensitivities, case 0")

    def _checked(self, unknowns: Float[Array, " n"]) -> tuple[Spacecraft, AttitudeState]:
        craft, state = self._of(unknowns)
        if state.quaternion.shape != (4,) or craft.inertia.shape != (3, 3):
            raise ValueError(
                "Sensitivities: satellite_of must return one satellite and one state, with an inertia of shape (3, 3) "
                f"and a quaternion of shape (4,), got {craft.inertia.shape} and {state.quaternion.shape}"
            )
        if state.rod_lag is not None:
            raise ValueError(
                "Sensitivities: motions with hysteresis rods have kinks: take differences of simulate, or "
                "simulate_on_grid with Runge-Kutta steps"
            )
        return craft, state

    def _body(self, unknowns: Float[Array, " n"]) -> tuple[RigidBody, AttitudeState]:
        """Satellite, ready to move, and state in the axes in which it is moved."""
        craft, state = self._checked(unknowns)
        q, w = quaternion.normalize(state.quaternion), state.angular_velocity
        if self._axes is not None:
            craft, w = in_axes(craft, self._axes), jnp.asarray(self._axes) @ w
            q = quaternion.multiply(q, quaternion.from_dcm(jnp.asarray(self._axes.T)))
        return RigidBody(craft, inverse_3x3(craft.inertia), self._torques), AttitudeState(q, w)

    def _nowhere(self, cases: np.ndarray) -> Absent:
        """Which elements are zero, with all their derivatives, but for rounding."""

        def body_of(unknowns):
            return arrays_of(self._body(unknowns)[0])

        return nowhere(*jax.jit(jax.vmap(lambda x: (body_of(x), jax.jacfwd(body_of)(x))))(cases))

    def _program(self, within, unknowns, table, grid, count):
        """Of groups of lanes: states, derivatives, inertia, what is known, rate, if what seemed absent is there."""
        n, width = unknowns.shape[1:]
        apart = width == 1  # One satellite: its tangents are the lanes, and its own motion is in each of them.
        lanes = -(-n // 8) * 8 if apart else width
        like = AttitudeState(jnp.zeros(4), jnp.zeros(3))
        last_only = bool(np.all(self._times == self._times[-1]))

        def final(x, table, grid, count):
            body, state = eqx.filter_vmap(self._body, in_axes=-1, out_axes=eqx.if_array(-1))(x)
            options = {"body_varies": True, "absent": self._absent, "count": count, "last_only": last_only}
            states = advance_parts(parts_of(state), like, body, table, grid, **options)
            return jax.vmap(jax.vmap(self._in_body_axes, -1, -1))(states), arrays_of(body)

        def of_group(x, table, grid, count):
            def along(x, direction):
                return jax.jvp(lambda x: final(x, table, grid, count), (x,), (direction,))

            if apart:
                (states, body), (slopes, turns) = along(jnp.broadcast_to(x, (n, lanes)), jnp.eye(n, lanes))
                states, slopes = states[..., :1], slopes[..., :n, None]
            else:
                directions = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, lanes))
                along = jax.vmap(along, in_axes=(None, 0), out_axes=((None, None), (2, -1)))
                (states, body), (slopes, turns) = along(x, directions)
            return states, slopes, jnp.maximum(present(body, self._absent), present(turns, self._absent))

        def motions(unknowns, table, grid, count):
            return jax.lax.map(lambda x: of_group(x, table, grid, count), unknowns)

        grid = jax.tree.map(jnp.asarray, grid)
        states, slopes, wrong = within(motions)(unknowns, table, grid, count)
        first = jax.tree.map(lambda leaf: leaf[:1], table)

        def beside(x):
            craft, state = self._checked(x)
            rate = 0.0 if self._max_step is not None else fastest_rate(craft, state, first)
            return craft.inertia, is_known(craft, state), rate

        inertia, known, rate = jax.vmap(beside)(jnp.moveaxis(unknowns, 1, 2).reshape(-1, n))
        return states, slopes, inertia, known, rate, wrong > 10.0 * DUST

    def _in_body_axes(self, state: Float[Array, "7"]) -> Float[Array, "7"]:
        q, w = quaternion.normalize(state[:4]), state[4:]
        if self._axes is None:
            return jnp.concatenate([q, w])
        back = quaternion.from_dcm(jnp.asarray(self._axes))
        return jnp.concatenate([quaternion.multiply(q, back), jnp.asarray(self._axes.T) @ w])
