"""Steps that end where the field along a hysteresis rod turns, of each case for itself.

Between two turns the motion is smooth, and a Runge-Kutta method of high order keeps its order. A step is tried along
the branches of the law on which it begins. Where the field along a rod has turned on the way, or a rod has come within
its loops, it is tried again to just after that; where the field has turned the rod goes over to its other branch.
"""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.dynamics import AttitudeState, RigidBody, body_environment, derivative
from jaxsat.environment import OrbitTable
from jaxsat.environment.cells import Cells
from jaxsat.environment.commands import CommandTable
from jaxsat.math import cross, quaternion
from jaxsat.simulate.lanes.crossings import Cubic
from jaxsat.simulate.rates import squared_pull
from jaxsat.simulate.turns import rods_of
from jaxsat.torques.abstract import required
from jaxsat.torques.branches import (
    heating,
    lag_from_nearness,
    nearness_after_turn,
    nearness_from_lag,
    nearness_slope,
)
from jaxsat.torques.hysteresis import field_along_rods, induction_from_lag, moment_of_induction

LANDING = 0.02
"""A turn within the last part of a step that is so long is at its end."""
OVERSHOOT = 0.005
"""Share of a step by which the next try ends after the turn that was found."""
SLIGHT = 1e-6
"""A nearness so little below zero is within the loops."""
LAGGING = 0.25
"""Weight of the square of the rate at which the lags change, against that of the motion; measured."""
NEAR = 25.0
"""Rods nearer to their loop do not move: their field sets no step."""


class Moving(eqx.Module):
    """What is integrated along the branches."""

    quaternion: Float[Array, "4"]
    angular_velocity: Float[Array, "3"]
    nearness: Float[Array, " rods"]
    heat: Float[Array, " rods"]
    """Volume times the integral of H dB since the start [J]."""


class Lane(eqx.Module):
    """One case on its way."""

    moving: Moving
    beyond: Float[Array, " rods"]
    rising: Bool[Array, " rods"]
    turning: Float[Array, "2 rods"]
    """First and second derivative of the field along the rods [A/m/s, A/m/s^2]."""
    pull: Float[Array, ""]
    """`squared_pull` where it is [1/s^2]."""
    cell: Int[Array, ""]
    since: Float[Array, ""]
    """From the start of the cell [s]."""
    mark: Int[Array, ""]
    """The next one."""
    longest: Float[Array, ""]
    """To which the next step is held where the last one went too far over a turn; else infinite [s]."""


class Own(eqx.Module):
    """What differs from case to case and does not change."""

    body: RigidBody
    smallest: Float[Array, "*cases"]
    """Moment of inertia [kg m^2]."""
    reach: Float[Array, "*cases"]
    """Length of a step times the rate of the motion."""
    max_step: Float[Array, "*cases"]
    """[s]."""


class Mark(eqx.Module):
    """A time at which a step of every lane ends."""

    cell: Int[Array, "*lanes"]
    since: Float[Array, "*lanes"]
    """From the start of the cell [s]."""
    commands: CommandTable | None
    """At the end of the way to it."""


class Stride(eqx.Module):
    """A step to be tried."""

    length: Float[Array, ""]
    """[s]."""
    to_mark: Float[Array, ""]
    """From its start [s]."""
    whole: Bool[Array, ""]
    """Whether it ends at the mark."""
    cell: Int[Array, ""]
    """Whose polynomials are read: that of its middle."""
    since: Float[Array, ""]
    """Its start, from the start of that cell [s]."""


class Taken(eqx.Module):
    """What became of a step."""

    length: Float[Array, ""]
    """[s]; zero where it was not taken."""
    travel: Float[Array, ""]
    """Bound of the change of a rod's field over its Hc."""
    arrived: Bool[Array, ""]
    """Whether the lane stands at its mark."""


def started(state: AttitudeState, own: Own, mark: Mark, cells: Cells, polynomials: OrbitTable) -> Lane:
    """A lane at the start of the cells, with the polynomials of the first one."""
    zero, since = jnp.zeros((), jnp.int32), jnp.zeros((), state.quaternion.dtype)
    point = _read(cells, polynomials, since, mark, _to_mark(mark, zero, since, cells))
    turning = _turning(state, derivative(state, point, own.body), point, since, own, cells, polynomials)
    rising = jnp.where(turning[0] == 0.0, turning[1] * cells.length, turning[0]) >= 0.0
    lag = required(state.rod_lag, "simulate", "AttitudeState.rod_lag", "the lag of the rods")
    nearness, beyond = nearness_from_lag(lag, rising)
    moving = Moving(state.quaternion, state.angular_velocity, nearness, jnp.zeros_like(nearness))
    return Lane(moving, beyond, rising, turning, _pull(own, point), zero, since, zero, jnp.full_like(since, jnp.inf))


def planned(lane: Lane, own: Own, mark: Mark, cells: Cells) -> Stride:
    """The step to be tried next: as long as the motion's rate allows, in equal parts of the way to the mark."""
    rods, remaining = rods_of(own.body), _to_mark(mark, lane.cell, lane.since, cells)
    per_field = (1.0 - rods.initial_slope) / (2.0 * rods.coercive_field)
    lagging = (per_field * lane.turning[0]) ** 2 + per_field * jnp.abs(lane.turning[1])
    lagging = _largest(jnp.where(lane.moving.nearness < NEAR, lagging, 0.0))
    rate = jnp.sqrt(jnp.sum(lane.moving.angular_velocity**2) + lane.pull + LAGGING * lagging)
    allowed = jnp.minimum(own.reach / rate, own.max_step)
    whole = jnp.abs(remaining) <= jnp.minimum(allowed, lane.longest)
    even = jnp.abs(remaining) / jnp.maximum(jnp.ceil(jnp.abs(remaining) / allowed), 1.0)
    h = jnp.where(whole, remaining, jnp.sign(remaining) * jnp.minimum(even, lane.longest))
    passed = jnp.floor((lane.since + 0.5 * h) / cells.length).astype(jnp.int32)
    cell = jnp.minimum(jnp.maximum(lane.cell + passed, 0), cells.count - 1)
    return Stride(h, remaining, whole, cell, lane.since - cells.span(cell - lane.cell))


def slope(
    moving: Moving,
    share: Float[Array, ""],
    lane: Lane,
    own: Own,
    stride: Stride,
    mark: Mark,
    cells: Cells,
    polynomials: OrbitTable,
) -> Moving:
    """Time derivative along the branches, a share of the step after its start."""
    done, rods = share * stride.length, rods_of(own.body)
    # What many numbers come of is kept: the compiler would work it out again for each.
    point = jax.lax.optimization_barrier(_read(cells, polynomials, stride.since + done, mark, stride.to_mark - done))
    lag = jax.lax.optimization_barrier(lag_from_nearness(moving.nearness, lane.beyond, lane.rising))
    state = AttitudeState(moving.quaternion, moving.angular_velocity, lag)
    rates, around = derivative(state, point, own.body, rising=lane.rising), body_environment(state, point)
    rate = required(around.b_field_rate_body, "simulate", "OrbitTable.b_rate_eci", "cells that know it")
    field_rate = field_along_rods(rods, rate)
    onward = jnp.where(lane.rising, field_rate, -field_rate)
    warming = heating(rods, moving.nearness, lag, around.b_field_body, field_rate)
    return Moving(rates.quaternion, rates.angular_velocity, nearness_slope(rods, moving.nearness) * onward, warming)


def settled(
    end: Moving,
    slopes: tuple[Moving, Moving],
    lane: Lane,
    own: Own,
    stride: Stride,
    mark: Mark,
    cells: Cells,
    polynomials: OrbitTable,
) -> tuple[Lane, Taken]:
    """The lane after the try of a step that led to `end`, with `slopes` at its ends, and what became of it."""
    rods, h, since = rods_of(own.body), stride.length, stride.since + stride.length
    end = dataclasses.replace(end, quaternion=quaternion.normalize(end.quaternion))
    state = AttitudeState(end.quaternion, end.angular_velocity, lane.beyond)
    point = _read(cells, polynomials, since, mark, stride.to_mark - h)
    turning = _turning(state, slopes[1], point, since, own, cells, polynomials)

    sign = jnp.where(lane.rising, 1.0, -1.0)
    onward = Cubic(sign * lane.turning[0], h * sign * lane.turning[1], sign * turning[0], h * sign * turning[1])
    turn = onward.first_fall()
    below = (-lane.moving.nearness - SLIGHT, -end.nearness - SLIGHT)
    outside = Cubic(below[0], -h * slopes[0].nearness, below[1], -h * slopes[1].nearness)
    earliest = -_largest(-jnp.minimum(turn, outside.first_fall()))
    taken = earliest >= 1.0 - LANDING
    turned = taken & (turn <= 1.0)

    # s H at the end less that at the turn: back along the old branch, and as far along the new one, both tiny.
    change = jnp.where(turned, h * onward.since(turn), 0.0)
    at_turn = nearness_after_turn(end.nearness - change * nearness_slope(rods, end.nearness), lane.beyond)
    nearness = jnp.where(turned, at_turn[0] - change * nearness_slope(rods, at_turn[0]), end.nearness)
    beyond = jnp.where(turned, at_turn[1], lane.beyond)
    rising = jnp.where(turned, ~lane.rising, lane.rising)
    b_field = body_environment(state, point).b_field_body
    missed = induction_from_lag(rods, lag_from_nearness(nearness, beyond, rising), b_field)
    missed -= induction_from_lag(rods, lag_from_nearness(end.nearness, lane.beyond, lane.rising), b_field)
    # Of the torque; it has grown as the square of the time since the turn and is a third of it on the average.
    missed = jnp.where(turned, missed * (1.0 - turn) * h / 3.0, 0.0)
    kick = own.body.inverse_inertia @ cross(moment_of_induction(rods, missed), b_field)

    arrived, passed = taken & stride.whole, jnp.floor(since / cells.length).astype(jnp.int32)
    new = Lane(
        Moving(end.quaternion, end.angular_velocity + kick, nearness, end.heat),
        beyond,
        rising,
        turning,
        _pull(own, point),
        jnp.where(arrived, mark.cell, stride.cell + passed),
        jnp.where(arrived, mark.since, since - cells.span(passed)),
        lane.mark + arrived.astype(jnp.int32),
        jnp.full_like(h, jnp.inf),
    )
    again = dataclasses.replace(lane, longest=jnp.abs(h) * (earliest + OVERSHOOT))
    fastest = jnp.maximum(jnp.abs(lane.turning[0]), jnp.abs(turning[0])) / rods.coercive_field
    became = Taken(jnp.where(taken, h, 0.0), jnp.abs(h) * _largest(fastest), arrived)
    return jax.tree.map(lambda a, b: jnp.where(taken, a, b), new, again), became


def _pull(own, point):
    return squared_pull(own.body.spacecraft, own.smallest, point.b_field_eci, point.position_eci)


def _to_mark(mark, cell, since, cells):
    return mark.since - since + cells.span(mark.cell - cell)


def _read(cells, polynomials, since, mark, to_mark) -> OrbitTable:
    """The table where a lane is, and what is commanded there: in straight lines to the mark."""
    point, ahead = cells.read(polynomials, since), mark.commands
    if ahead is None:
        return point
    rates = ahead.rates_before
    values = {name: x - to_mark * rates[name] if name in rates else x for name, x in ahead.values_before.items()}
    return dataclasses.replace(point, commands=CommandTable(values, rates, values, rates))


def _turning(state, slope, point, since, own, cells, polynomials):
    """First and second derivative of the fields along the rods."""

    def to_body(v):
        return quaternion.rotate_inverse(state.quaternion, v)

    rods, w, b, b_rate = (
        rods_of(own.body),
        state.angular_velocity,
        to_body(point.b_field_eci),
        to_body(point.b_rate_eci),
    )
    first = b_rate - cross(w, b)
    second = to_body(cells.field_acceleration(polynomials, since)) - cross(w, b_rate)
    second = second - cross(slope.angular_velocity, b) - cross(w, first)
    return jnp.stack([field_along_rods(rods, first), field_along_rods(rods, second)])


def _largest(values: Float[Array, " n"]) -> Float[Array, ""]:
    # Written out: the compiler then meets nothing but numbers.
    return functools.reduce(jnp.maximum, [values[k] for k in range(values.shape[0])])
