"""A motion and its derivatives by the variational equations, over a grid of Runge and Kutta's method.

The motion's own steps are those of `jaxsat.simulate.simulate_on_grid`. Its derivatives are solutions of the linear
equations about it, d(phi)' = R d(w), d(w)' = A R^T d(phi) + B d(w) + c, phi a small turn in inertial axes and R the
attitude (Hairer, Norsett & Wanner 1993, sec. I.14), by the same method with the same steps. That is a quarter of the
work of carrying tangents through every operation of a step, and it is done for as many nodes at once as there are in a
block. They are off by what a step is off: a thousandth on the grid of a fit's end.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsat.dynamics import AttitudeState, RigidBody, derivative
from jaxsat.environment import OrbitTable
from jaxsat.integrators import BLOCK, RK4, StepGrid, nodes_of_steps, staged_step
from jaxsat.math import quaternion

MIDDLE = (5.0 / 24.0, 1.0 / 6.0, 1.0 / 6.0, -1.0 / 24.0)
"""Weights of a step's four slopes for the state in its middle, to third order (Hairer, Norsett & Wanner 1993, II.6)."""

Columns = tuple[Float[Array, "3 unknowns"], Float[Array, "3 unknowns"]]
"""Derivatives by each unknown: small turn in inertial axes [rad], change of rate in body axes [rad/s]."""


class Tangent(eqx.Module):
    """The linear equations at one node."""

    attitude: Float[Array, "*nodes 3 3"]
    """Inertial-from-body."""
    by_turn: Float[Array, "*nodes 3 3"]
    """Change of the angular acceleration [rad/s^2] by a small turn in body axes."""
    by_rate: Float[Array, "*nodes 3 3"]
    by_unknowns: Float[Array, "*nodes 3 unknowns"]
    """With the motion as it is."""

    def accelerations(
        self, turns: Float[Array, "3 unknowns"], rates: Float[Array, "3 unknowns"]
    ) -> Float[Array, "3 unknowns"]:
        """Change of the angular acceleration with small turns in body axes and changes of rate."""
        return _times(self.by_turn, turns) + _times(self.by_rate, rates) + self.by_unknowns

    def slopes(self, columns: Columns) -> Columns:
        """Derivatives by time."""
        turns, rates = columns
        return _times(self.attitude, rates), self.accelerations(_times(self.attitude.T, turns), rates)


def _times(matrix: Float[Array, "3 3"], columns: Float[Array, "3 unknowns"]) -> Float[Array, "3 unknowns"]:
    """The product, written out: no library of kernels is called for nine numbers."""
    return sum((matrix[:, k : k + 1] * columns[k][None] for k in range(1, 3)), matrix[:, :1] * columns[0][None])


class Equations(eqx.Module):
    """Those of a body and, to first order, of what moves it."""

    body: Any
    """Arrays of a `RigidBody`."""
    slopes: Any
    """Of the same, the unknowns in front."""
    rest: Any = eqx.field(static=True)
    ahead: int = eqx.field(static=True)
    """Unknowns in front of those of the body: the state's."""

    @staticmethod
    def of(body_of: Callable[[Array], RigidBody], shift: Float[Array, " parameters"], ahead: int) -> "Equations":
        body, rest = eqx.partition(body_of(shift), eqx.is_array)
        slopes = jax.jacfwd(lambda shift: eqx.filter(body_of(shift), eqx.is_array))(shift)
        return Equations(body, jax.tree.map(lambda leaf: jnp.moveaxis(leaf, -1, 0), slopes), rest, ahead)

    def derivative(self, state: AttitudeState, point: OrbitTable) -> AttitudeState:
        """That of the motion by time."""
        return derivative(state, point, eqx.combine(self.body, self.rest))

    def at(self, state: AttitudeState, point: OrbitTable) -> tuple[Float[Array, "3"], Tangent]:
        """The angular acceleration [rad/s^2], and the linear equations about it."""
        q, w = state.quaternion, state.angular_velocity

        def of_state(turn, w):
            q_near = quaternion.multiply(q, quaternion.from_rotation_vector(turn))
            return self.derivative(AttitudeState(q_near, w), point).angular_velocity

        def of_body(body):
            return derivative(state, point, eqx.combine(body, self.rest)).angular_velocity

        by_turn, by_rate = jax.jacfwd(of_state, argnums=(0, 1))(jnp.zeros_like(w), w)
        of_unknowns = jax.vmap(lambda slope: jax.jvp(of_body, (self.body,), (slope,))[1], out_axes=-1)(self.slopes)
        of_unknowns = jnp.pad(of_unknowns, ((0, 0), (self.ahead, 0)))
        return of_body(self.body), Tangent(quaternion.to_dcm(q), by_turn, by_rate, of_unknowns)


def motion_and_columns(
    equations: Equations,
    initial: AttitudeState,
    columns: Columns,
    table: OrbitTable,
    grid: StepGrid,
    blocks: Int[Array | np.ndarray, ""],
) -> tuple[AttitudeState, tuple[Float[Array, "samples 3 unknowns"], Float[Array, "samples 3 unknowns"]]]:
    """States and derivatives at the samples of a grid, of which so many blocks of steps are taken.

    Of samples beyond, those at the beginning stand. `columns` are the derivatives at the beginning, their turns and
    those of the result in body axes.
    """
    steps = grid.step.shape[0]
    kept = jnp.asarray(grid.sample_index)
    number = jnp.arange(1, steps + 1)
    place = jnp.searchsorted(kept, number)
    # One place more for what nobody asks for.
    place = jnp.where(jnp.take(kept, place, mode="clip") == number, place, kept.shape[0])
    inputs = (jnp.asarray(grid.step), nodes_of_steps(table, steps), place)
    inputs = jax.tree.map(lambda leaf: leaf.reshape(steps // BLOCK, BLOCK, *leaf.shape[1:]), inputs)
    columns = (_times(quaternion.to_dcm(initial.quaternion), columns[0]), columns[1])

    def block(number, carry):
        (state, columns), found = carry
        lengths, points, places = jax.tree.map(lambda leaf: leaf[number], inputs)
        state, (begins, middles, ends) = jax.lax.scan(_step(equations), state, (lengths, points))
        tangents = _tangents(equations, (begins, middles, ends), points)
        columns, of_columns = jax.lax.scan(_columns_step, columns, (lengths, tangents))
        for k in range(BLOCK):
            found = jax.tree.map(
                lambda all_of, new, k=k: jax.lax.dynamic_update_index_in_dim(all_of, new[k], places[k], 0),
                found,
                (ends, of_columns),
            )
        return (state, columns), found

    blank = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (kept.shape[0] + 1, *leaf.shape)), (initial, columns))
    _, found = jax.lax.fori_loop(0, blocks, block, ((initial, columns), blank))
    state, (turns, rates) = jax.tree.map(lambda leaf: leaf[jnp.searchsorted(kept, kept)], found)
    to_body = jnp.swapaxes(quaternion.to_dcm(state.quaternion), 1, 2)
    return state, (jax.vmap(_times)(to_body, turns), rates)


def _step(equations: Equations):
    """One step of the motion, and the states at its begin, in its middle and at its end."""

    def step(state, inputs):
        length, points = inputs
        points = (*points[:-1], points[-1].at_end())
        end, slopes = staged_step(RK4, equations.derivative, state, length, points)
        shares = [length * weight for weight in MIDDLE]
        middle = jax.tree.map(lambda y, k: y + sum(s * k[n] for n, s in enumerate(shares)), state, slopes)
        middle, end = (AttitudeState(quaternion.normalize(y.quaternion), y.angular_velocity) for y in (middle, end))
        return end, (state, middle, end)

    return step


def _tangents(
    equations: Equations, states: tuple[AttitudeState, ...], points: tuple[OrbitTable, ...]
) -> tuple[Tangent, ...]:
    """The linear equations at begins, middles and ends of the steps of a block, all of them at once."""
    begins, middles, ends = zip(states, (*points[:-1], points[-1].at_end()), strict=True)
    # Where nothing jumps at the end of a step, it is the begin of the next one.
    last = ends if points[-1].commands is not None else jax.tree.map(lambda leaf: leaf[-1:], ends)
    every = jax.tree.map(lambda *leaves: jnp.concatenate(leaves), begins, middles, last)
    _, found = jax.vmap(equations.at)(*every)
    begin, middle, end = (jax.tree.map(lambda leaf, n=n: leaf[n * BLOCK : (n + 1) * BLOCK], found) for n in range(3))
    if points[-1].commands is None:
        end = jax.tree.map(lambda a, b: jnp.concatenate([a[1:], b]), begin, end)
    return begin, middle, end


def _columns_step(columns: Columns, inputs: tuple[Array, tuple[Tangent, ...]]) -> tuple[Columns, Columns]:
    """One step of the derivatives."""
    length, (begin, middle, end) = inputs

    def moved(slopes, reach):
        return jax.tree.map(lambda y, k: y + reach * length * k, columns, slopes)

    first = begin.slopes(columns)
    second = middle.slopes(moved(first, 0.5))
    third = middle.slopes(moved(second, 0.5))
    fourth = end.slopes(moved(third, 1.0))
    weighted = jax.tree.map(lambda a, b, c, d: a + 2.0 * (b + c) + d, first, second, third, fourth)
    found = moved(weighted, 1.0 / 6.0)
    return found, found
