"""Coils and wheels along columns of commands against scipy's DOP853 with equations of our own, and their momentum."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import AbstractMagneticField, Commands
from jaxsat.environment.orbit import AbstractOrbit
from jaxsat.environment.surroundings import Surroundings
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate, simulate_many, simulate_on_grid
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import Coil, Wheel, commanded_columns

RNG = np.random.default_rng(5)
TURN = Rotation.random(rng=RNG).as_matrix()
INERTIA = TURN @ np.diag([1.5e-3, 1.7e-3, 1.9e-3]) @ TURN.T
Q, W = Rotation.random(rng=RNG).as_quat(scalar_first=True), np.array([-0.02, 0.05, -0.03])
FIELD = np.array([2.1e-5, -1.4e-5, 2.8e-5])
SPAN = 300.0
COIL_AXES, AREAS = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]), (2.0, 1.5)
WHEEL_AXES, WHEELS = np.array([[0.0, 0.0, 1.0], [0.48, 0.6, -0.64]]), (2e-5, 1e-5)
COIL_ROWS = np.arange(0.0, SPAN, 5.0)
WHEEL_ROWS = np.concatenate([np.arange(0.0, SPAN, 20.0), [SPAN]])
CURRENTS = np.where(RNG.random((2, len(COIL_ROWS))) < 0.5, 0.0, 0.01 * RNG.choice([-1.0, 1.0], (2, len(COIL_ROWS))))
SPEEDS = RNG.normal(scale=5.0, size=(2, len(WHEEL_ROWS)))
PARTS = (
    *(Coil(axis, area, f"coil {k}") for k, (axis, area) in enumerate(zip(COIL_AXES, AREAS, strict=True))),
    *(Wheel(axis, inertia, f"wheel {k}") for k, (axis, inertia) in enumerate(zip(WHEEL_AXES, WHEELS, strict=True))),
)
COLUMNS = {f"coil {k}": (COIL_ROWS, CURRENTS[k]) for k in range(2)} | {
    f"wheel {k}": (WHEEL_ROWS, SPEEDS[k]) for k in range(2)
}
HELD, LINEAR = commanded_columns(PARTS)
COMMANDS = Commands.of(COLUMNS, held=HELD, linear=LINEAR)


class Steady(AbstractMagneticField):
    """A field that stays as it is."""

    def __call__(self, position):
        return jnp.asarray(FIELD)


class Far(AbstractOrbit):
    """So far from the Earth that its gravity turns nothing."""

    def __call__(self, t):
        return jnp.asarray([1e12, 0.0, 0.0]) + 0.0 * t, jnp.zeros(3)

    def check_span(self, times):
        """It is known at all times."""


ORBIT = Far()
SURROUNDINGS = Surroundings(ORBIT, Steady(), 0.0, 0.0, commands=COMMANDS)
KINDS = (("coils",), ("wheels",), ("coils", "wheels"))


def truth(parts):
    """Attitudes and rates at the ends of five-second pieces, within which nothing jumps."""
    coils, wheels = "coils" in parts, "wheels" in parts
    inverse, y, found = np.linalg.inv(INERTIA), np.concatenate([Q, W]), [np.concatenate([Q, W])]
    for begin in COIL_ROWS:
        k = int(np.searchsorted(WHEEL_ROWS, begin, side="right")) - 1
        slopes = (SPEEDS[:, k + 1] - SPEEDS[:, k]) / 20.0
        dipole = (np.array(AREAS) * CURRENTS[:, round(begin / 5.0)]) @ COIL_AXES

        def slope(t, y, k=k, slopes=slopes, dipole=dipole):
            q, w = y[:4], y[4:]
            momentum, torque = INERTIA @ w, np.zeros(3)
            if wheels:
                momentum = momentum + (WHEELS * (SPEEDS[:, k] + slopes * (t - WHEEL_ROWS[k]))) @ WHEEL_AXES
                torque = torque - (WHEELS * slopes) @ WHEEL_AXES
            if coils:
                torque = torque + np.cross(dipole, Rotation.from_quat(q, scalar_first=True).inv().apply(FIELD))
            turn = np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])
            return np.concatenate([0.5 * turn, inverse @ (torque - np.cross(w, momentum))])

        y = solve_ivp(slope, (begin, begin + 5.0), y, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        found.append(y)
    return np.array(found)


def chosen(kinds):
    return tuple(part for part in PARTS if ("coils" if isinstance(part, Coil) else "wheels") in kinds)


def start():
    return AttitudeState(jnp.asarray(Q), jnp.asarray(W))


def angles(found, expected):
    a, b = (Rotation.from_quat(np.asarray(q), scalar_first=True) for q in (found, expected))
    return (a.inv() * b).magnitude()


@pytest.fixture(scope="module")
def expected():
    return {kinds: truth(kinds) for kinds in KINDS}


@pytest.mark.parametrize("kinds", KINDS, ids="+".join)
def test_motion_is_that_of_equations_in_numpy(kinds, expected):
    times = np.append(COIL_ROWS[1:], SPAN)
    craft, errors = Spacecraft(jnp.asarray(INERTIA), parts=chosen(kinds)), []
    for step in (1.0, 0.5):
        grid = StepGrid.through(times, start=0.0, max_step=step)
        motion = jax.jit(simulate_on_grid)(craft, start(), SURROUNDINGS(grid.node_times), grid)
        errors.append(angles(motion.quaternion, expected[kinds][1:, :4]).max())
    # As a method of fourth order does, though something jumps at every second node or so: a wrong impulse would halve.
    assert errors[1] < 2e-6 and errors[1] < errors[0] / 6.0


def test_a_tolerance_holds_over_jumps_that_are_no_samples(expected):
    craft = Spacecraft(jnp.asarray(INERTIA), parts=PARTS)
    times = np.array([55.0, 140.0, SPAN])
    motion = simulate(craft, start(), SURROUNDINGS, times, tolerance=1e-5)
    truths = expected["coils", "wheels"][(times / 5.0).astype(int)]
    assert angles(motion.quaternion, truths[:, :4]).max() < 1e-5
    np.testing.assert_allclose(motion.angular_velocity, truths[:, 4:], atol=1e-6)
    # And back: what was held before a row is what is held after it on this way.
    last = AttitudeState(jnp.asarray(truths[-1, :4]), jnp.asarray(truths[-1, 4:]))
    back = simulate(craft, last, SURROUNDINGS, np.array([140.0, 55.0, 0.0]), start=SPAN, tolerance=1e-5)
    assert angles(back.quaternion, [truths[1, :4], truths[0, :4], Q]).max() < 1e-5


def test_wheels_and_body_keep_their_momentum():
    grid = StepGrid.through(WHEEL_ROWS[1:], start=0.0, max_step=0.5)
    craft = Spacecraft(jnp.asarray(INERTIA), parts=chosen(("wheels",)))
    motion = jax.jit(simulate_on_grid)(craft, start(), SURROUNDINGS(grid.node_times), grid)
    q, w = np.asarray(motion.quaternion), np.asarray(motion.angular_velocity)

    def momentum(q, w, speeds):
        return Rotation.from_quat(q, scalar_first=True).apply(INERTIA @ w + (WHEELS * speeds) @ WHEEL_AXES)

    first = momentum(Q, W, SPEEDS[:, 0])
    found = np.array([momentum(*each) for each in zip(q, w, SPEEDS.T[1:], strict=True)])
    np.testing.assert_allclose(found, np.tile(first, (len(found), 1)), atol=3e-6 * float(np.linalg.norm(first)))


def test_slopes_by_areas_inertias_and_start_are_differences():
    grid = StepGrid.through(COIL_ROWS[1:13], start=0.0, max_step=1.0)
    table = SURROUNDINGS(grid.node_times)

    def end(x):
        parts = (
            Coil(COIL_AXES[0], 2.0 * x[0], "coil 0"),
            Wheel(x[1:4], 2e-5 * x[4], "wheel 0"),
        )
        state = AttitudeState(jnp.asarray(Q), jnp.asarray(W) * x[5])
        motion = simulate_on_grid(Spacecraft(jnp.asarray(INERTIA), parts=parts), state, table, grid)
        return jnp.concatenate([motion.quaternion[-1], motion.angular_velocity[-1]])

    x = np.array([1.0, 0.0, 0.1, 1.0, 1.0, 1.0])
    slopes = np.asarray(jax.jit(jax.jacfwd(end))(x))
    ends, h = jax.jit(jax.vmap(end)), 1e-5
    differences = (np.asarray(ends(x + h * np.eye(6))) - np.asarray(ends(x - h * np.eye(6)))).T / (2.0 * h)
    np.testing.assert_allclose(slopes, differences, atol=1e-8 * np.abs(slopes).max())


def test_many_at_once_move_as_each_alone():
    """Their tables' columns are taken apart too."""
    times, craft = COIL_ROWS[1:13], Spacecraft(jnp.asarray(INERTIA), parts=PARTS[:1])
    calm = Surroundings(
        ORBIT, Steady(), 0.0, 0.0, commands=Commands.of({"coil 0": (np.zeros(1), np.full(1, 0.01))}, held=("coil 0",))
    )
    initial = AttitudeState(jnp.tile(jnp.asarray(Q), (3, 1)), jnp.asarray(W)[None] * jnp.asarray([[1.0], [0.5], [0.0]]))
    together = simulate_many(craft, initial, calm, times, tolerance=1e-8)
    for k in range(3):
        one = jax.tree.map(lambda x, k=k: x[k], initial)
        alone = simulate(craft, one, calm, times, tolerance=1e-8)
        assert angles(together.quaternion[k], alone.quaternion).max() < 2e-8
