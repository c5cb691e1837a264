"""Cases that are moved together, in chunks that stay in the cache, on all cores."""

import dataclasses
import functools
import math
import os
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState, RigidBody
from jaxsat.environment import OrbitTable
from jaxsat.integrators import DORMAND_PRINCE_8
from jaxsat.integrators.adams import ORDER, STABLE
from jaxsat.integrators.adams import REACH as ADAMS_REACH
from jaxsat.math import inverse_3x3
from jaxsat.math.one_function import WIDE, whole_or_usual
from jaxsat.simulate.checks import check_table
from jaxsat.simulate.lanes.by_turns import move_lanes
from jaxsat.simulate.lanes.course import Layout, lay_course
from jaxsat.simulate.on_grid import trajectory
from jaxsat.simulate.parts import Absent, advance_parts, parts_of, varying
from jaxsat.simulate.pieces import Piece, most_steps, pieces_of
from jaxsat.simulate.rates import fastest_rate
from jaxsat.simulate.single import COARSER, TURN_REACH, UNRESOLVED, angles, first_reach, hold, longest_step
from jaxsat.simulate.tabulating import Tabulate, tabulated
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque

R = TypeVar("R")

CHUNK = 1000
"""Cases of one call on a CPU."""
GROUP = 40
"""Of them are moved side by side: the slopes of twelve steps of so many fill a core's first cache."""
LANES = 16
"""The same of satellites with hysteresis rods, which wait for the slowest of their chunk."""
LEAST_REACH = 0.09
"""Of steps of eighth order: shorter ones gain nothing, for rounding."""
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
    tolerance: float
    """Of attitudes, which what surrounds the satellites is to be worthy of [rad]."""
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
        most = LANES if self.in_lanes else CHUNK
        return min(most, self.cases) if jax.default_backend() == "cpu" else self.cases

    def of(self, chosen: np.ndarray) -> "Batch":
        """The same of some of the cases, in the order given."""
        if np.array_equal(chosen, np.arange(self.cases)):
            return self
        initial, own = jax.tree.map(
            lambda leaf: jnp.asarray(np.asarray(leaf)[chosen]), (self.initial, self.spacecraft if self.varies else None)
        )
        return dataclasses.replace(self, initial=initial, spacecraft=own if self.varies else self.spacecraft)

    @property
    def in_lanes(self) -> bool:
        """Whether each has steps of its own, which end where the fields along its hysteresis rods turn."""
        return self.initial.rod_lag is not None

    @property
    def rods(self) -> int:
        """Hysteresis rods of each."""
        return 0 if self.initial.rod_lag is None else self.initial.rod_lag.shape[-1]

    @property
    def parts(self) -> int:
        """Components of the state: quaternion, angular velocity, lags and heats of the rods."""
        return 7 + 2 * self.rods

    @functools.cached_property
    def layout(self) -> Layout:
        """What lanes go through."""
        dtype = self.initial.quaternion.dtype
        return lay_course(self.surroundings, self.times, self.start, self.tolerance, "simulate_many", dtype)

    def first_reach(self, tolerance: float) -> float:
        """Step times the fastest rate to try first."""
        if self.in_lanes:
            return first_reach(tolerance, DORMAND_PRINCE_8.order, TURN_REACH, math.inf)
        return first_reach(tolerance, ORDER, ADAMS_REACH, STABLE)

    def step_within(self, tolerance: float) -> tuple[float, float]:
        """Step [s] with which the pilot chunk is within the tolerance, and the pilot's error [rad]."""
        rates = self.rates
        fastest = np.argsort(rates)[::-1][: (self.chunk + 1) // 2]
        spread = np.linspace(0, self.cases - 1, self.chunk - len(fastest)).astype(int)
        pilot = np.concatenate([fastest, spread])

        def both(step):
            fine, room = self._by_adams(pilot, step, 0)
            coarse, _ = self._by_adams(pilot, COARSER * step, room)
            return trajectory(fine, None, 0), trajectory(coarse, None, 0)

        first = self.first_reach(tolerance) / float(rates.max())
        first = min(first, longest_step(self.times, self.start, None) / COARSER)
        step, error, _ = hold(tolerance / PILOT_MARGIN, first, ORDER, self.times, self.start, both)
        return step, error

    def lanes_within(self, tolerance: float) -> tuple[Float[np.ndarray, "cases samples parts"], np.ndarray]:
        """Components of all cases, each with steps of its own, and the error of each [rad].

        It is the largest angle to the same motion with steps 1.5 times as long. Where that is above the tolerance the
        steps are shortened until rounding leaves nothing to be gained.
        """
        longest = longest_step(self.times, self.start, DORMAND_PRINCE_8)
        found = np.zeros((self.cases, len(self.times), self.parts), self.initial.quaternion.dtype)
        errors, reach = np.full(self.cases, np.inf), np.full(self.cases, self.first_reach(tolerance))
        left = np.arange(self.cases)
        while left.size:
            fine = self.by_turns(left, reach[left], longest / COARSER)
            coarse = self.by_turns(left, COARSER * reach[left], longest)
            error = np.max(angles(fine[..., :4], coarse[..., :4]), axis=1, initial=0.0)
            better = left[error < errors[left]]
            found[better], errors[better] = fine[error < errors[left]], error[error < errors[left]]
            wanted = (0.5 * tolerance / np.maximum(error, 1e-300)) ** (1.0 / DORMAND_PRINCE_8.order)
            shrink = np.where(error < UNRESOLVED, wanted, 0.25)
            before = reach[left]
            reach[left] = np.maximum(np.clip(shrink, 0.25, 0.9) * before, LEAST_REACH)
            left = left[(error > tolerance) & (before > 1.2 * LEAST_REACH)]
        return found, errors

    @functools.cached_property
    def rates(self) -> Float[np.ndarray, " cases"]:
        """Rate scale of each case's coming motion [rad/s]."""
        table = tabulated(self.surroundings, np.array([self.start]))
        check_table(table, "simulate_many")
        return np.asarray(_rates(self.spacecraft, self.initial, table, body_varies=self.varies))

    def run(self, chosen: np.ndarray, max_step: float) -> Float[np.ndarray, "cases samples parts"]:
        """Components of the chosen cases at the requested times, chunk after chunk on all cores."""
        if self.in_lanes:
            return self.by_turns(chosen, np.full(len(chosen), np.inf), max_step)
        return self._by_adams(chosen, max_step, 0)[0]

    def by_turns(
        self, chosen: np.ndarray, reach: Float[np.ndarray, " chosen"], max_step: float
    ) -> Float[np.ndarray, "chosen samples parts"]:
        """The same in lanes, with steps of `reach` over the rate of each motion and at most `max_step` [s]."""
        layout, varies = self.layout, self.varies
        # Lanes wait for the slowest of their chunk.
        order = np.argsort(self.rates[chosen] / np.minimum(reach, 1.0), kind="stable")

        def one(places):
            numbers = chosen[places]
            some = self.of(numbers)
            return move_lanes(
                some.initial,
                some._body(some.spacecraft),
                layout,
                reach=reach[places],
                max_step=np.full(len(numbers), max_step),
                tableau=DORMAND_PRINCE_8,
                varies=varies,
            ).states

        found = np.concatenate(in_chunks(one, order, self.chunk))[: len(chosen)]
        return found[np.argsort(order, kind="stable")]

    def _table(self, times: Float[Array | np.ndarray, " n"]) -> OrbitTable:
        # The orbit in double precision whatever the motion's own: seconds and metres outgrow seven digits.
        table = tabulated(self.surroundings, times)
        check_table(table, "simulate_many")
        return jax.tree.map(lambda x: x.astype(self.initial.quaternion.dtype), table)

    @property
    def _last_only(self) -> bool:
        """Whether the end of the arc alone is asked for, and nothing has to be kept on the way."""
        return bool(np.all(self.times == self.times[-1]))

    def _pieces(self, max_step: float, width: int, room: int) -> list[Piece]:
        most = most_steps(0 if self._last_only else width * workers())
        return pieces_of(self.times, start=self.start, max_step=max_step, most=most, room=room)

    def _by_adams(
        self, chosen: np.ndarray, max_step: float, room: int
    ) -> tuple[Float[np.ndarray, "cases samples parts"], int]:
        """Components, and the steps of Adams for which the program has room: `room` or more.

        The program of shorter steps serves longer ones too.
        """
        width = self.chunk
        if self.asked_chunk is None and jax.default_backend() == "cpu":
            # Few shapes, few compilations; and something to do for each core.
            share = -(-len(chosen) // (os.cpu_count() or 1))
            few = max(2, 1 << (share - 1).bit_length())
            width = few if few <= GROUP else min(CHUNK, -(-share // GROUP) * GROUP)
        like = jax.tree.map(lambda leaf: np.zeros(leaf.shape[1:], leaf.dtype), self.initial)
        body = self._body(self.spacecraft)
        absent = self._absent(body)
        varied = varying(body) if self.varies else None
        of_chosen = jax.tree.map(lambda leaf: np.moveaxis(np.asarray(leaf)[chosen], 0, -1), (self.initial, varied))
        now, own = np.stack(parts_of(of_chosen[0])), of_chosen[1]
        found = np.zeros((len(self.times), *now.shape), now.dtype)
        pieces = self._pieces(max_step, width, room)
        for piece in pieces:
            table = self._table(piece.grid.node_times)

            def one(numbers, piece=piece, table=table, now=now):
                parts = tuple(part[numbers] for part in now)
                its = jax.tree.map(lambda leaf: leaf[..., numbers], own)
                its_body = eqx.tree_at(varying, body, its) if self.varies else body
                options = (self.varies, absent, self._last_only)
                return np.asarray(_advance(parts, like, its_body, table, piece.grid, piece.count, *options))

            shapes = piece.grid.steps, len(piece.grid.sample_first)
            program = (width, *shapes, self.varies, absent, self._last_only)
            states = np.concatenate(in_chunks(one, np.arange(len(chosen)), width, program), axis=-1)
            states = states[..., : len(chosen)]
            now = states[0]
            found[piece.samples] = now if self._last_only else states[piece.read]
        return np.moveaxis(found, -1, 0), pieces[0].grid.steps

    def _body(self, spacecraft: Spacecraft) -> RigidBody:
        inverse = (jax.vmap(inverse_3x3) if self.varies else inverse_3x3)(spacecraft.inertia)
        return RigidBody(spacecraft, inverse, self.torques)

    def _absent(self, body: RigidBody) -> Absent:
        own = eqx.filter(body, eqx.is_array)
        zero = jax.tree.map(lambda x: np.asarray(x) == 0.0, own)
        if self.varies:
            zero = eqx.tree_at(varying, zero, jax.tree.map(lambda x: np.all(x, axis=0), varying(zero)))
        return tuple(tuple(x.reshape(-1).tolist()) for x in jax.tree.leaves(zero))


def workers() -> int:
    """Chunks that are done at once."""
    return (os.cpu_count() or 1) if jax.default_backend() == "cpu" else 1


_BEGUN: set[Hashable] = set()
"""Programs that were called: who comes to a new one with several threads would compile it in each."""


def in_chunks(
    one: Callable[[np.ndarray], R], chosen: np.ndarray, width: int, program: Hashable | None = None
) -> list[R]:
    """`one` of the numbers of each chunk, the last one filled up with repeats, on all cores.

    The first chunk goes alone where `program`, which says what is compiled for them, is new.
    """
    chunks = [np.resize(chosen[begin : begin + width], width) for begin in range(0, len(chosen), width)]
    alone = 1 if len(chunks) == 1 or (program is not None and program not in _BEGUN) else 0
    found = [one(chunk) for chunk in chunks[:alone]]
    _BEGUN.add(program)
    if alone == len(chunks):
        return found
    # Two programs at once use two cores better than one program that shares its small loops out.
    with ThreadPoolExecutor(workers()) as pool:
        return found + list(pool.map(one, chunks[alone:]))


@eqx.filter_jit
def _rates(spacecraft, initial, table, *, body_varies):
    return eqx.filter_vmap(fastest_rate, in_axes=(eqx.if_array(0) if body_varies else None, 0, None))(
        spacecraft, initial, table
    )


def _advance_chunk(within, parts, like, body, table, grid, count, body_varies, absent, last_only):
    """A chunk in groups that stay in the first cache, one after the other."""
    grid, (cases,) = jax.tree.map(jnp.asarray, grid), parts[0].shape
    # Other devices want all of it at once.
    groups = -(-cases // GROUP) if jax.default_backend() == "cpu" else 1

    def together(leaf):
        filled = jnp.take(leaf, np.arange(-(-cases // groups) * groups) % cases, axis=-1)
        return jnp.moveaxis(filled.reshape(*leaf.shape[:-1], groups, -1), -2, 0)

    own = jax.tree.map(together, (parts, varying(body) if body_varies else None))

    def motions(own, body, table, grid, count):
        def of_group(own):
            parts, varied = own
            its = eqx.tree_at(varying, body, varied) if body_varies else body
            options = {"body_varies": body_varies, "absent": absent, "count": count, "last_only": last_only}
            return advance_parts(parts, like, its, table, grid, **options)

        return jax.lax.map(of_group, own)

    found = within(motions)(own, body, table, grid, count)
    return jnp.moveaxis(found, 0, -2).reshape(*found.shape[1:-1], -1)[..., :cases]


_advance = whole_or_usual(_advance_chunk, WIDE)
