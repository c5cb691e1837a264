"""Days of motion of many passive satellites at once: magnet along body x, hysteresis rods along y and z.

The equations are the library's, with gravity gradient and the air's drag off the centre of mass; each case is a lane of
one scan (`jaxsat.math.case_scan`), an orbit a call, in steps of one length. What is kept of an orbit is the mean of
2 (1 - cos) of the angle between magnet and field, which is the mean square of a small angle. All is a function of
the satellites' numbers in JAX: derivatives flow through any number of orbits in forward mode (`slopes_by_orbit`).
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState, RigidBody, derivative
from jaxsat.environment import OrbitTable, Surroundings
from jaxsat.math import cross, quaternion
from jaxsat.math.case_scan import scan_cases
from jaxsat.math.runge_kutta import RK4, runge_kutta_step
from jaxsat.math.scalars import elements
from jaxsat.simulate.turns import past_turns, rod_fields, rods_of
from jaxsat.spacecraft import HysteresisRods, Spacecraft
from jaxsat.torques import AbstractTorque, lag_from_induction
from jaxsat.torques.abstract import BodyEnvironment, required

AXES = np.eye(3)
DRAG_AREA = 2.2 * 0.035
"""Drag coefficient times the mean area of a 3U, a quarter of its surface [m^2]."""


class Numbers(NamedTuple):
    """What differs from satellite to satellite, arrays over the cases."""

    inertia: Float[Array | np.ndarray, "cases 3"]
    """Principal moments, that about the magnet first [kg m^2]."""
    dipole: Float[Array | np.ndarray, " cases"]
    """[A m^2]."""
    volumes: Float[Array | np.ndarray, "cases 2"]
    """Of all rods along y, and of all along z [m^3]."""
    loop: Float[Array | np.ndarray, "cases 3"]
    """Coercive field [A/m], remanence and saturation [T] as they appear outside a rod."""
    centre: Float[Array | np.ndarray, "cases 3"]
    """Where the air pushes, from the centre of mass, body axes [m]."""


class OffCentreDrag(AbstractTorque):
    """Drag on a body of the same area from all sides, c x F with F = -rho v v C A / 2."""

    smooth: ClassVar[bool] = True

    centre: Float[Array, "3"]
    """Where it acts, from the centre of mass, body axes [m]."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        v = required(around.air_velocity_body, "OffCentreDrag", "OrbitTable.air_velocity_eci", "an atmosphere")
        density = required(around.air_density, "OffCentreDrag", "OrbitTable.air_density", "an atmosphere")
        return cross(self.centre, -0.5 * DRAG_AREA * density * jnp.sqrt(jnp.sum(v**2)) * v)


class Orbits(NamedTuple):
    """Field and place at the nodes of equal steps, orbit by orbit."""

    tables: list[OrbitTable]
    """Leaves [steps, 3, ...]: start, middle and end of each step."""
    step: float
    """[s]."""
    period: float
    """[s]."""


def laid(around: Surroundings, count: int, period: float, step: float, *, first: int = 0) -> Orbits:
    """So many orbits from orbit `first` on, in equal steps of at most `step` [s]; the field's rate must be known."""
    steps = int(np.ceil(period / step))
    tabulate = eqx.filter_jit(lambda times: around(times))
    tables = []
    for number in range(first, first + count):
        nodes = tabulate(jnp.asarray(number * period + 0.5 * period / steps * np.arange(2 * steps + 1)))
        tables.append(jax.tree.map(lambda x: np.stack([x[:-1:2], x[1::2], x[2::2]], axis=1), nodes))
    return Orbits(tables, period / steps, period)


def body_of(inertia, dipole, volumes, loop, centre) -> RigidBody:
    """The satellite of one case."""
    rods = HysteresisRods(AXES[1:], volumes, *(each * jnp.ones(2) for each in loop))
    # Numbers that no compiler has to multiply by.
    rods = eqx.tree_at(lambda rods: (rods.axes, rods.exponent, rods.initial_slope), rods, (AXES[1:], 2, np.zeros(())))

    def diagonal(values):
        return jnp.stack([jnp.stack([values[i] if i == j else 0.0 for j in range(3)]) for i in range(3)])

    craft = Spacecraft(
        diagonal(inertia), jnp.stack([dipole, 0.0, 0.0]), hysteresis_rods=rods, parts=(OffCentreDrag(centre),)
    )
    return RigidBody(craft, diagonal(1.0 / inertia), None)


def demagnetised(numbers: Numbers, q: np.ndarray, w: np.ndarray, orbits: Orbits) -> AttitudeState:
    """The state of all cases at the start of the orbits, the rods without induction."""

    def lag(q, *of_case):
        b_field = quaternion.rotate_inverse(q, jnp.asarray(orbits.tables[0].b_field_eci[0, 0]))
        return lag_from_induction(rods_of(body_of(*of_case)), jnp.zeros(2), b_field)

    return AttitudeState(q, w, jax.jit(jax.vmap(lag))(jnp.asarray(q), *map(jnp.asarray, numbers)))


def _step(numbers, h, carry, nodes):
    """One step of RK4 along the branches of the rods, brought to where their turns lead (`attitude_step`), and the
    sum of 2 (1 - cos) and of the squared rate about the magnet."""
    hold, (state, sums), body = jax.lax.optimization_barrier, carry, body_of(*numbers)
    begin, middle, end = (jax.tree.map(lambda x, k=k: x[k], nodes) for k in range(3))
    before = rod_fields(state, begin, body)

    def slope(state, point):
        return hold(derivative(hold(state), point, body, rising=before.rate >= 0.0))

    state = runge_kutta_step(RK4, slope, state, h, (begin, middle, middle, end))
    state = eqx.tree_at(lambda state: state.quaternion, state, quaternion.normalize(state.quaternion))
    state = past_turns(hold(state), h, before, end, body)
    b = quaternion.rotate_inverse(state.quaternion, end.b_field_eci)
    off = 2.0 - 2.0 * b[0] / jnp.sqrt(jnp.sum(b**2))
    return state, sums + jnp.stack([off, state.angular_velocity[0] ** 2])


def _orbit(numbers: Numbers, state: AttitudeState, table: OrbitTable, step: float | Float[Array, ""]):
    """States an orbit later; means [cases, 2] of 2 (1 - cos) [rad^2] and of the squared spin [rad^2/s^2] over it."""
    columns, structure = jax.tree.flatten(jax.tree.map(jnp.asarray, table))
    numbers = jax.tree.map(jnp.asarray, tuple(numbers))
    of_case, of_step = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[1:], x.dtype), (numbers, tuple(columns)))
    step, steps = jnp.asarray(step), columns[0].shape[0]

    def one_step(numbers, step, carry, *columns):
        return _step(numbers, step, carry, jax.tree.unflatten(structure, columns))

    def drawn(number):
        return tuple(elements(column[number]) for column in columns)

    begin = (state, jnp.zeros((state.quaternion.shape[0], 2)))
    like = (of_case, jax.ShapeDtypeStruct((), step.dtype))
    state, sums = scan_cases(one_step, (numbers, step), like, begin, steps, drawn=drawn, drawn_like=of_step)
    return state, sums / steps


one_orbit = jax.jit(_orbit)


@jax.jit
def _pushed(numbers, state, d_numbers, d_state, table, step):
    """`_orbit` and its derivatives along several directions, whose axis is in front of the tangents."""

    def along(d_numbers, d_state):
        return jax.jvp(lambda n, s: _orbit(n, s, table, step), (numbers, state), (d_numbers, d_state))

    (state, means), (d_state, d_means) = jax.vmap(along, out_axes=((None, None), (0, 0)))(d_numbers, d_state)
    return state, means, d_state, d_means


def by_orbit(
    numbers: Numbers, start: AttitudeState, orbits: Orbits, *, chunk: int, tell: Callable[[int], object] = bool
) -> tuple[np.ndarray, AttitudeState]:
    """Means over each orbit [cases, orbits, 2], as `_orbit`, and the last states; in chunks on two threads.

    A case is the same whatever the others: the last chunk is filled with its first case.
    """
    cases = len(numbers.dipole)
    order = np.concatenate([np.arange(cases), np.zeros(-cases % chunk, dtype=int)])

    def run(part):
        own, state = jax.tree.map(lambda x: np.asarray(x)[part], (numbers, start))
        found = []
        for table in orbits.tables:
            state, means = one_orbit(own, state, table, orbits.step)
            found.append(np.asarray(means))
        tell(int(part[-1]))
        return np.stack(found, axis=1), jax.device_get(state)

    with ThreadPoolExecutor(2) as pool:
        parts = list(pool.map(run, np.split(order, len(order) // chunk)))
    means, states = jax.tree.map(lambda *each: np.concatenate(each)[:cases], *parts)
    return means, states


def slopes_by_orbit(
    numbers: Numbers, directions: Numbers, start: AttitudeState, orbits: Orbits
) -> tuple[np.ndarray, np.ndarray]:
    """Means over each orbit [cases, orbits, 2], and their exact derivatives [directions, cases, orbits, 2].

    Forward mode through all orbits, along `directions`: changes of the numbers, with an axis of them in front.
    """
    count = len(directions.dipole)
    d_state = jax.tree.map(lambda x: jnp.zeros((count, *x.shape)), start)
    state, found, slopes = start, [], []
    for table in orbits.tables:
        state, means, d_state, d_means = _pushed(numbers, state, directions, d_state, table, orbits.step)
        found.append(np.asarray(means))
        slopes.append(np.asarray(d_means))
    return np.stack(found, axis=1), np.stack(slopes, axis=2)
