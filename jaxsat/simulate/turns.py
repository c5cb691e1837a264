"""Steps across the turns of the field along hysteresis rods, where their law has a break in its slope.

A step is taken as if the rods stayed on the branch of rising or falling fields on which they begin it: a smooth motion.
On a branch the lag depends on the field alone and can go back as it came. So where the field has turned at the end of
a step, the lag goes back to the turn along the old branch and from there along the new one. The turn's field is that of
the cubic through fields and rates at both ends: what is left is of the fourth order, without it of the second.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState, RigidBody, body_environment
from jaxsat.environment import OrbitTable
from jaxsat.math import cross, quaternion
from jaxsat.spacecraft import HysteresisRods
from jaxsat.torques import induction_from_lag, lag_along_branch
from jaxsat.torques.abstract import required
from jaxsat.torques.hysteresis import field_along_rods, moment_of_induction


class RodFields(eqx.Module):
    """The field along each rod at one end of a step."""

    field: Float[Array, " rods"]
    """[A/m]."""
    rate: Float[Array, " rods"]
    """[A/m/s]."""


def rod_fields(state: AttitudeState, point: OrbitTable, body: RigidBody) -> RodFields:
    """Fields along the rods of a satellite, and their rates."""
    rods, around = rods_of(body), body_environment(state, point)
    source = "tabulate_orbit(..., field_rate=True)"
    rate = required(around.b_field_rate_body, "AttitudeState.rod_lag", "OrbitTable.b_rate_eci", source)
    return RodFields(field_along_rods(rods, around.b_field_body), field_along_rods(rods, rate))


def rods_of(body: RigidBody) -> HysteresisRods:
    """The rods of a satellite; ValueError where it has none."""
    rods = body.spacecraft.hysteresis_rods
    return required(rods, "AttitudeState.rod_lag", "Spacecraft.hysteresis_rods", "the rods, as HysteresisRods")


def past_turns(
    state: AttitudeState, h: Float[Array, ""], before: RodFields, point: OrbitTable, body: RigidBody
) -> AttitudeState:
    """End of a step `h` [s] that began with the fields `before` and kept to its branches, as the turns would have it.

    Since its turn a rod has changed its lag as the square of the time, so that what it missed of torque is a third of
    what it misses at the end, over that time, and for the attitude a twelfth over the time squared.
    """
    rods, after = rods_of(body), rod_fields(state, point, body)
    branch = required(state.rod_lag, "past_turns", "AttitudeState.rod_lag", "the state of a step with rods")
    rising = before.rate >= 0.0
    turned = rising != (after.rate >= 0.0)
    back, since = _turn(
        jnp.where(turned, h * before.rate, 1.0),
        jnp.where(turned, h * after.rate, -1.0),
        jnp.where(turned, after.field - before.field, 0.0),
    )
    back, since = jnp.where(turned, back, 0.0), jnp.where(turned, h * since, 0.0)
    at_turn = lag_along_branch(rods, branch, rising, back)
    lag = lag_along_branch(rods, at_turn, ~rising, -back)
    b_field = body_environment(state, point).b_field_body
    missed = induction_from_lag(rods, lag, b_field) - induction_from_lag(rods, branch, b_field)

    def change(weights):
        torque = cross(moment_of_induction(rods, missed * weights), b_field)
        return body.inverse_inertia @ torque

    turn = change(since**2 / 12.0)
    return AttitudeState(
        quaternion=quaternion.normalize(state.quaternion + 0.5 * quaternion.times_vector(state.quaternion, turn)),
        angular_velocity=state.angular_velocity + change(since / 3.0),
        rod_lag=lag,
    )


def _turn(first_slope, last_slope, change):
    """Way back from the end to the extremum of a cubic between its ends, and the share of the step since then.

    Slopes over the step, of opposite signs; `change` from its first to its last value.
    """
    square = 3.0 * change - 2.0 * first_slope - last_slope
    cube = first_slope + last_slope - 2.0 * change
    root = jnp.sqrt(square * square - 3.0 * cube * first_slope)
    place = first_slope / (-square + jnp.where(first_slope > 0.0, root, -root))
    return place * (first_slope + place * (square + place * cube)) - change, 1.0 - place
