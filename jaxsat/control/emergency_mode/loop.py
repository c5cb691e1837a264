"""The emergency mode a control period at a time: measure, filter, decide, switch the dipole, move (Somov 2018).

Its motion is that of `jaxsat.control.loops`. Its period is not: it measures over the whole of one, so that a reading
needs the motion at both ends, and while the coils rest for years a step takes four periods, which no schedule has.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsat.control import loops
from jaxsat.control.attitude_error import modified_rodrigues
from jaxsat.control.emergency_mode.law import EmergencyLaw, wanted_torque
from jaxsat.control.emergency_mode.orbit import Leg, wanted_attitude
from jaxsat.control.emergency_mode.rotating_panels import inertia_at, panel_torque
from jaxsat.control.emergency_mode.vehicle import (
    CALM_S,
    CONTROL_PERIOD_S,
    SAMPLES,
    TURN_OFF_DEG,
    TURN_ON_DEG,
    EmergencyVehicle,
    turned_panels,
)
from jaxsat.control.loops import Motion, Vehicle, motion_rates
from jaxsat.control.magnetic_actuator import actuator_dipole
from jaxsat.environment import OrbitTable
from jaxsat.environment.orbit.sampled import hermite_coefficients
from jaxsat.math import cross, inverse_3x3, quaternion
from jaxsat.spacecraft import Spacecraft

Actuator = Callable[[Float[Array, "3"], Float[Array, "3"], Float[Array, ""]], Float[Array, "3"]]
"""Dipole [A m^2] for a torque [N m], a field [T] and the largest dipole, as `actuator_dipole`."""
NOISES = 9
"""Random numbers of one control period: attitude, rate and field, three axes each."""


@dataclass(frozen=True)
class Supervisor:
    """When the actuator works; the thresholds are of the filtered error."""

    turn_on: float = math.radians(TURN_ON_DEG)
    """[rad]; 0 for an actuator that is always on, infinite for one that never is."""
    turn_off: float = math.radians(TURN_OFF_DEG)
    """[rad]"""
    calm_s: float = CALM_S


ALWAYS_ON, ALWAYS_OFF = Supervisor(turn_on=0.0, turn_off=0.0), Supervisor(turn_on=math.inf)


class Filtered(eqx.Module):
    """Means of the measurements of one control period."""

    error: Float[Array, "3"]
    """Four times the modified Rodrigues parameters from the wanted attitude to the body [rad]."""
    rate_error: Float[Array, "3"]
    """[rad/s]"""
    b_field_body: Float[Array, "3"]
    """[T]"""


class LoopState(eqx.Module):
    """One satellite and the memory of its computer."""

    quaternion: Float[Array, "4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "3"]
    """Body axes [rad/s]."""
    seen: Filtered
    memory: Float[Array, "3"]
    """Of eq. 3."""
    active: Bool[Array, ""]
    """Whether the actuator works."""
    calm: Float[Array, ""]
    """For how long the error has been small [s]."""
    activations: Float[Array, ""]
    impulse: Float[Array, ""]
    """Sum of the three dipoles' sizes over time [A m^2 s]."""


class Sample(eqx.Module):
    """The end of one control period as a person would plot it."""

    error: Float[Array, "3"]
    """True attitude error as a rotation vector, body axes [rad]."""
    rate_error: Float[Array, "3"]
    """True rate against the orbital axes [rad/s]."""
    tilt: Float[Array, ""]
    """Angle of body y from the vertical [rad]."""
    dipole: Float[Array, "3"]
    """Of this period [A m^2]."""
    active: Bool[Array, ""]


def errors(
    leg: Leg, q: Float[Array, "4"], w: Float[Array, "3"]
) -> tuple[Float[Array, "4"], Float[Array, "3"], Float[Array, "3 3"]]:
    """Quaternion wanted-from-body, rate error in body axes [rad/s] and the wanted attitude at one node."""
    wanted = wanted_attitude(leg.position_eci, leg.normal_eci)
    off = quaternion.multiply(quaternion.conjugate(quaternion.from_dcm(wanted)), q)
    off = jnp.where(off[0] < 0.0, -off, off)
    return off, w - leg.orbit_rate * quaternion.rotate_inverse(q, leg.normal_eci), wanted


def first_state(
    leg: Leg, off: Float[Array, "4"], angular_velocity: Float[Array, "3"], vehicle: EmergencyVehicle
) -> LoopState:
    """Nothing done yet; at the leg's first node the attitude is `off`, wanted-from-body, with an inertial rate."""
    leg = jax.tree.map(lambda leaf: leaf[0], leg)
    wanted = quaternion.from_dcm(wanted_attitude(leg.position_eci, leg.normal_eci))
    q = quaternion.multiply(wanted, off)
    found, rate_error, _ = errors(leg, q, angular_velocity)
    seen = Filtered(4.0 * modified_rodrigues(found), rate_error, _field_body(vehicle, leg.b_field_eci, q))
    zero = jnp.zeros(())
    return LoopState(q, angular_velocity, seen, jnp.zeros(3), jnp.asarray(False), zero, zero, zero)


def one_period(
    supervisor: Supervisor,
    law: EmergencyLaw,
    vehicle: EmergencyVehicle,
    nodes: tuple[Leg, Leg, Leg],
    state: LoopState,
    noise: Float[Array, "9"] | None,
    *,
    periods: int = 1,
    actuator: Actuator = actuator_dipole,
) -> tuple[LoopState, Sample]:
    """One control period of 16 s, from its begin over its middle to its end; `noise` are unit normal numbers.

    Where the actuator is off several `periods` may be taken in one step. `actuator` gives the dipole for a torque.
    """
    period = periods * CONTROL_PERIOD_S
    active, calm = supervised(supervisor, state, period)
    seen = state.seen
    known = vehicle.assumed_inertia
    if nodes[0].panels is not None:
        known = inertia_at(known, vehicle.panel_inertia, nodes[0].panels.angle)
    torque, memory = wanted_torque(law, known, seen.error, seen.rate_error, state.memory, period)
    dipole = actuator(torque, seen.b_field_body, law.max_dipole)
    dipole = jnp.where(active, dipole, 0.0)

    q, w = moved(vehicle, nodes, state.quaternion, state.angular_velocity, dipole, period)
    seen, (off, rate_error) = _measured(vehicle, nodes, state, q, w, noise, periods)
    after = LoopState(
        quaternion=q,
        angular_velocity=w,
        seen=seen,
        memory=jnp.where(active, memory, 0.0),
        active=active,
        calm=calm,
        activations=state.activations + jnp.where(active & ~state.active, 1.0, 0.0),
        impulse=state.impulse + period * jnp.sum(jnp.abs(dipole)),
    )
    # The vertical in body axes is the second row of the error's matrix.
    up = quaternion.rotate_inverse(off, jnp.array([0.0, 1.0, 0.0]))
    tilt = jnp.arctan2(jnp.sqrt(up[0] ** 2 + up[2] ** 2), up[1])
    return after, Sample(quaternion.to_rotation_vector(off), rate_error, tilt, dipole, active)


def supervised(
    supervisor: Supervisor, state: LoopState, period: float = CONTROL_PERIOD_S
) -> tuple[Bool[Array, ""], Float[Array, ""]]:
    """Whether the actuator works in the period to come, and for how long [s] the error has been small by its end."""
    size2 = jnp.sum(state.seen.error**2)
    calm = jnp.where(size2 < supervisor.turn_off**2, state.calm + period, 0.0)
    return (size2 >= supervisor.turn_on**2) | (state.active & (calm < supervisor.calm_s)), calm


def moved(
    vehicle: EmergencyVehicle,
    nodes: tuple[Leg, Leg, Leg],
    q: Float[Array, "4"],
    w: Float[Array, "3"],
    dipole: Float[Array, "3"],
    period: float = CONTROL_PERIOD_S,
) -> tuple[Float[Array, "4"], Float[Array, "3"]]:
    """Attitude and rate at the end of a `period` [s] of constant dipole [A m^2]: RK4, one step.

    By the equations of every loop (`motion_rates`): gravity gradient, dipole x field, solar pressure where the vehicle
    has a surface; and the torque of panels that turn (eq. 1).
    """

    def slope(motion, node):
        inertia, inverse, facets, torque = vehicle.inertia, vehicle.inverse_inertia, vehicle.facets, None
        if node.panels is not None:
            inertia = inertia_at(inertia, vehicle.panel_inertia, node.panels.angle)
            inverse = inverse_3x3(inertia)
            torque = panel_torque(vehicle.panel_inertia, node.panels, motion.angular_velocity)
            facets = None if facets is None else turned_panels(facets, node.panels.angle)
        field = vehicle.field_error @ node.b_field_eci
        point = OrbitTable(node.position_eci, field, sun_eci=node.sun_eci, solar_pressure=node.solar_pressure)
        body = Vehicle(Spacecraft(inertia, facets=facets), inverse)
        return motion_rates(body, motion, point, dipole, None, torque)

    after = loops.moved(slope, Motion(q, w), period, nodes)
    return after.quaternion, after.angular_velocity


def _field_body(vehicle, b_field_eci, q):
    return quaternion.rotate_inverse(q, vehicle.field_error @ b_field_eci)


def _measured(vehicle, nodes, before, q, w, noise, periods):
    """Means of the measurements a second apart, the last at the end; and the true errors there.

    The attitude error between the ends is taken as the cubic through both with their rates, rate and field as straight
    lines: less off a simulation by the second than the noise is.
    """
    begin, _, end = nodes
    off0, rate0, _ = errors(begin, before.quaternion, before.angular_velocity)
    off1, rate1, _ = errors(end, q, w)
    first, last = (4.0 * modified_rodrigues(off) for off in (off0, off1))
    # Half a turn off the parameters jump from one side to the other.
    first = jnp.where(jnp.sum((first - last) ** 2) > 4.0, last, first)
    samples = periods * SAMPLES
    values, slopes, lines = _weights(samples)
    error = values[0] * first + values[1] * last
    period = periods * CONTROL_PERIOD_S
    error = error + period * (slopes[0] * _rise(first, rate0) + slopes[1] * _rise(last, rate1))
    rate = lines[0] * rate0 + lines[1] * rate1
    field = lines[0] * _field_body(vehicle, begin.b_field_eci, before.quaternion)
    field = vehicle.magnetometer_error @ (field + lines[1] * _field_body(vehicle, end.b_field_eci, q))
    if noise is not None:
        root = math.sqrt(samples)
        error = error + vehicle.sigmas[0] / root * noise[:3]
        rate = rate + vehicle.sigmas[1] / root * noise[3:6]
        field = field + vehicle.sigmas[2] / root * noise[6:]
    return Filtered(error, rate, field), (off1, rate1)


def _rise(error, rate):
    """Rate of four times the modified Rodrigues parameters (Schaub & Junkins 1996, eq. 21)."""
    p = 0.25 * error
    square = jnp.sum(p**2)
    return (1.0 - square) * rate + 2.0 * cross(p, rate) + 2.0 * p * jnp.sum(p * rate)


def _weights(samples):
    """Weights of both ends' values, of both ends' slopes, and of both ends of a line, in the mean of the samples."""
    s = np.arange(1, samples + 1) / samples
    table = hermite_coefficients(2)
    mean = np.mean(table @ (s - 0.5) ** np.arange(table.shape[1])[:, None], axis=1)
    half = np.mean(s)
    return mean[:2], mean[2:], (1.0 - half, half)
