"""Cases that are moved together, in chunks that stay in the cache, on all cores."""

import dataclasses
import functools
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState, RigidBody
from jaxsat.environment import OrbitTable
from jaxsat.integrators import RK4, AdamsGrid, StepGrid
from jaxsat.integrators.adams import ORDER, STABLE
from jaxsat.integrators.adams import REACH as ADAMS_REACH
from jaxsat.integrators.grid import BLOCK
from jaxsat.math import inverse_3x3
from jaxsat.simulate.checks import (
    check_table,
)
from jaxsat.simulate.on_grid import Trajectory, simulate_on_grid
from jaxsat.simulate.parts import Absent, advance_parts, parts_of, varying
from jaxsat.simulate.single import (
    COARSER,
    Tabulate,
    bucket,
    fastest_rate,
    first_reach,
    hold,
    jumps,
    longest_step,
)
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque

CHUNK = 1024
"""Cases of one chunk on a CPU: their state and slopes fill a core's cache."""
PILOT_MARGIN = 3.0
"""The worst of all cases may be this many times worse than the worst of the pilot's."""


@dataclasses.dataclass(frozen=True)
class Batch:
    """Cases on one orbit that are moved together, in chunks that fill a core's cache."""

    spacecraft: Spacecraft
    initial: AttitudeState
    surroundings: Tabulate
    times: np.ndarray
    """[s]"""
    start: float
    """Of `initial` [s]."""
    torques: tuple[AbstractTorque, ...] | None
    asked_chunk: int | None

    @property
    def cases(self) -> int:
        """How many."""
        return self.initial.quaternion.shape[0]

    @property
    def varies(self) -> bool:
        """Whether each has a satellite of its own."""
        return self.spacecraft.inertia.ndim == 3

    @property
    def chunk(self) -> int:
        """Cases done at once."""
        if self.asked_chunk is not None:
            return min(self.asked_chunk, self.cases)
        return min(CHUNK, self.cases) if jax.default_backend() == "cpu" else self.cases

    def of(self, chosen: np.ndarray) -> "Batch":
        """The same of some of the cases, in the order given."""
        if len(chosen) == self.cases:
            return self
        initial, own = jax.tree.map(
            lambda leaf: jnp.asarray(np.asarray(leaf)[chosen]), (self.initial, self.spacecraft if self.varies else None)
        )
        return dataclasses.replace(self, initial=initial, spacecraft=own if self.varies else self.spacecraft)

    @property
    def in_steps(self) -> bool:
        """Whether rods with hysteresis want Runge-Kutta steps: over the turns of their fields no other holds."""
        return self.initial.rod_lag is not None

    def first_reach(self, tolerance: float) -> float:
        """Step times the fastest rate to try first."""
        if self.in_steps:
            return first_reach(tolerance, RK4.order, RK4.reach, math.inf)
        return first_reach(tolerance, ORDER, ADAMS_REACH, STABLE)

    def step_within(self, tolerance: float, rates: Float[np.ndarray, " cases"]) -> tuple[float, float]:
        """Step [s] with which the pilot chunk is within the tolerance, and the pilot's error [rad]."""
        fastest = np.argsort(rates)[::-1][: (self.chunk + 1) // 2]
        spread = np.linspace(0, self.cases - 1, self.chunk - len(fastest)).astype(int)
        pilot = np.concatenate([fastest, spread])

        def attempt(step):
            return trajectory(self.run(pilot, step), None)

        first = self.first_reach(tolerance) / float(rates.max())
        tableau, order = (RK4, RK4.order) if self.in_steps else (None, ORDER)
        first = min(first, longest_step(self.times, self.start, tableau) / COARSER)
        step, error, _ = hold(tolerance / PILOT_MARGIN, first, order, self.times, self.start, attempt)
        return step, error

    def rates(self) -> Float[np.ndarray, " cases"]:
        """Rate scale of each case's coming motion [rad/s]."""
        table = _tabulated(self.surroundings, np.array([self.start]))
        check_table(table, "simulate_many")
        return np.asarray(_rates(self.spacecraft, self.initial, table, body_varies=self.varies))

    def run(self, chosen: np.ndarray, max_step: float) -> Float[np.ndarray, "cases samples parts"]:
        """Components of the chosen cases at the requested times, chunk after chunk on all cores."""
        return self._by_steps(chosen, max_step) if self.in_steps else self._by_adams(chosen, max_step)

    def _by_steps(self, chosen: np.ndarray, max_step: float) -> Float[np.ndarray, "cases samples parts"]:
        """By RK4, whose steps go across the turns of hysteresis rods; what stands between the samples is not kept."""
        stops = jumps(self.surroundings)
        lay = functools.partial(StepGrid.through, self.times, start=self.start, max_step=max_step, stops=stops)
        used = lay().step.shape[0]
        grid = lay(pad_steps=bucket(used))
        table = self._table(grid.node_times)
        varies, blocks = self.varies, np.asarray(used // BLOCK)

        def one(numbers):
            initial, craft = (
                jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[numbers]), tree) if over_cases else tree
                for tree, over_cases in ((self.initial, True), (self.spacecraft, varies))
            )
            return np.asarray(_steps(craft, initial, table, grid, self.torques, blocks, body_varies=varies))

        return np.concatenate(self._in_chunks(one, chosen))[: len(chosen)]

    def _table(self, times: Float[Array | np.ndarray, " n"]) -> OrbitTable:
        # The orbit in double precision whatever the motion's own: seconds and metres outgrow seven digits.
        table = _tabulated(self.surroundings, times)
        check_table(table, "simulate_many")
        return jax.tree.map(lambda x: x.astype(self.initial.quaternion.dtype), table)

    def _in_chunks(self, one: Callable[[np.ndarray], np.ndarray], chosen: np.ndarray) -> list[np.ndarray]:
        """`one` of the numbers of each chunk, the last one filled up with repeats."""
        chunks = [
            np.resize(chosen[begin : begin + self.chunk], self.chunk) for begin in range(0, len(chosen), self.chunk)
        ]
        # Two programs at once use two cores better than one program that shares its small loops out.
        workers = (os.cpu_count() or 1) if jax.default_backend() == "cpu" else 1
        with ThreadPoolExecutor(workers) as pool:
            return list(pool.map(one, chunks))

    def _by_adams(self, chosen: np.ndarray, max_step: float) -> Float[np.ndarray, "cases samples parts"]:
        grid = AdamsGrid.through(self.times, start=self.start, max_step=max_step)
        count = grid.steps
        grid = grid.padded(bucket(count))
        table = self._table(grid.node_times)
        # At the last step's end alone nothing has to be kept on the way.
        last_only = bool(np.all(self.times == self.times[-1]))
        like = jax.tree.map(lambda leaf: np.zeros(leaf.shape[1:], leaf.dtype), self.initial)
        body = self._body()
        absent = self._absent(body)
        varied = varying(body) if self.varies else None

        def one(numbers):
            initial, own = jax.tree.map(
                lambda leaf: np.moveaxis(np.asarray(leaf)[numbers], 0, -1), (self.initial, varied)
            )
            its_body = eqx.tree_at(varying, body, own) if self.varies else body
            states = _advance(
                parts_of(initial), like, its_body, table, grid, np.asarray(count), self.varies, absent, last_only
            )
            return np.asarray(states)

        found = np.concatenate(self._in_chunks(one, chosen), axis=-1)
        return np.moveaxis(found[..., : len(chosen)], -1, 0)

    def _body(self) -> RigidBody:
        inverse = (jax.vmap(inverse_3x3) if self.varies else inverse_3x3)(self.spacecraft.inertia)
        return RigidBody(self.spacecraft, inverse, self.torques)

    def _absent(self, body: RigidBody) -> Absent:
        own = eqx.filter(body, eqx.is_array)
        zero = jax.tree.map(lambda x: np.asarray(x) == 0.0, own)
        if self.varies:
            zero = eqx.tree_at(varying, zero, jax.tree.map(lambda x: np.all(x, axis=0), varying(zero)))
        return tuple(tuple(x.reshape(-1).tolist()) for x in jax.tree.leaves(zero))


def trajectory(states: Float[np.ndarray, "cases samples parts"], error: float | None) -> Trajectory:
    """Of components at the requested times; a case that is not finite is NaN and listed in `diverged`."""
    q = states[..., :4]
    with np.errstate(all="ignore"):
        length = np.linalg.norm(q, axis=-1, keepdims=True)
        unit = q / length
    # A motion thrown out by unstable steps may still be finite: its quaternion is not of unit length.
    finite = np.isfinite(states).all(axis=(1, 2)) & np.all(np.abs(length - 1.0) < 0.5, axis=(1, 2))
    return Trajectory(
        quaternion=jnp.asarray(np.where(finite[:, None, None], unit, np.nan)),
        angular_velocity=jnp.asarray(states[..., 4:7]),
        rod_lag=jnp.asarray(states[..., 7:]) if states.shape[-1] > 7 else None,
        error=error,
        diverged=tuple(np.flatnonzero(~finite).tolist()),
    )


@eqx.filter_jit
def _tabulated(surroundings: Tabulate, times: Float[Array | np.ndarray, " n"]) -> OrbitTable:
    return surroundings(times)


@eqx.filter_jit
def _rates(spacecraft, initial, table, *, body_varies):
    return eqx.filter_vmap(fastest_rate, in_axes=(eqx.if_array(0) if body_varies else None, 0, None))(
        spacecraft, initial, table
    )


@eqx.filter_jit
def _steps(spacecraft, initial, table, grid, torques, blocks, *, body_varies):
    grid = jax.tree.map(jnp.asarray, grid)

    def one(craft, state):
        found = simulate_on_grid(craft, state, table, grid, torques=torques, blocks=blocks)
        parts = (found.quaternion, found.angular_velocity, found.rod_lag)
        return jnp.concatenate([part for part in parts if part is not None], axis=-1)

    return eqx.filter_vmap(one, in_axes=(eqx.if_array(0) if body_varies else None, 0))(spacecraft, initial)


def _advance_chunk(parts, like, body, table, grid, count, body_varies, absent, last_only):
    grid = jax.tree.map(jnp.asarray, grid)
    return advance_parts(
        parts, like, body, table, grid, body_varies=body_varies, absent=absent, count=count, last_only=last_only
    )


# The compiler prefers half of a 512-bit register, which costs a third of the speed; narrower processors do not mind.
_OPTIONS: dict = {"compiler_options": {"xla_cpu_prefer_vector_width": 512}}
_advance = eqx.filter_jit(_advance_chunk, **_OPTIONS)
