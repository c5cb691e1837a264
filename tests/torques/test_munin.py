"""Torques: textbook values, signs by the motion they cause, slopes against differences."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import (
    BodyEnvironment,
    GravityGradient,
    LinearRodsTorque,
    PermanentMagnet,
    gravity_gradient_torque,
    magnetic_torque,
    torques_of,
)

MU = 3.986004415e14
INERTIA = np.array([[0.0514, 0.0004, -0.0002], [0.0004, 0.0549, 0.0001], [-0.0002, 0.0001, 0.0578]])
MAGNET = np.array([0.3, 0.004, -0.01])
MOMENTS, REFERENCE = np.array([0.035, 0.025]), 3.0e-5
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.6, 0.8]])
R_BODY = np.array([-3.5e6, 6.1e6, 2.9e6])
B_BODY = np.array([1.2e-5, -2.5e-5, 0.7e-5])
PANELS = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
ALL = {"gravity": GravityGradient(), "magnet": PermanentMagnet(), "rods": LinearRodsTorque()}


def craft_with(inertia=INERTIA, magnet=MAGNET, moments=MOMENTS, axes=AXES):
    rods = MagneticRods(jnp.asarray(moments), jnp.asarray(axes), jnp.asarray(REFERENCE))
    return Spacecraft(jnp.asarray(inertia), jnp.asarray(magnet), rods, PANELS)


def around(position=R_BODY, b_field=B_BODY):
    return BodyEnvironment(jnp.asarray(position), jnp.asarray(b_field), jnp.zeros(3))


TEXTBOOK = {
    "gravity": 3 * MU / np.linalg.norm(R_BODY) ** 5 * np.cross(R_BODY, INERTIA @ R_BODY),
    "magnet": np.cross(MAGNET, B_BODY),
    "rods": sum(np.cross(m * (B_BODY @ e) / REFERENCE * e, B_BODY) for m, e in zip(MOMENTS, AXES, strict=True)),
}


@pytest.mark.parametrize("name", ALL)
def test_textbook_value(name):
    found = jax.jit(ALL[name])(craft_with(), around())
    np.testing.assert_allclose(found, TEXTBOOK[name], rtol=1e-13)
    stacked = jax.tree.map(lambda x: jnp.stack([x, x]), around())
    np.testing.assert_allclose(
        jax.jit(jax.vmap(ALL[name], (None, 0)))(craft_with(), stacked), [TEXTBOOK[name]] * 2, rtol=1e-13
    )


def test_model_of_munin_is_the_three_together():
    total = sum(np.asarray(torque(craft_with(), around())) for torque in torques_of(craft_with()))
    np.testing.assert_allclose(total, sum(TEXTBOOK.values()), rtol=1e-13)


def test_torques_vanish_where_physics_says_so():
    principal = gravity_gradient_torque(jnp.asarray([0.0, 7e6, 0.0]), jnp.diag(jnp.asarray([0.05, 0.06, 0.03])))
    np.testing.assert_array_equal(principal, 0.0)
    # Products of 8e-6 N m cancel, each rounded once.
    np.testing.assert_allclose(magnetic_torque(jnp.asarray(1e4 * B_BODY), jnp.asarray(B_BODY)), 0.0, atol=2e-21)
    # An alternative gravity field scales the torque.
    np.testing.assert_allclose(GravityGradient(mu=2 * MU)(craft_with(), around()), 2 * TEXTBOOK["gravity"], rtol=1e-13)


@pytest.mark.parametrize("name", ALL)
def test_slopes_against_differences(name):
    """Torques are polynomials or smooth powers: with relative steps of 1e-4 central differences are good to 1e-7."""

    def torque(scale):
        # Each input, moved by its own size.
        inertia = INERTIA + scale[0] * np.diag([0.01, 0.0, 0.0]) + scale[1] * 0.01 * (np.eye(3)[::-1])
        magnet, moments = MAGNET + scale[2] * np.array([0.0, 0.1, 0.1]), MOMENTS * (1 + scale[3])
        position, b_field = R_BODY + scale[4] * 1e6 * np.array([1.0, 2, -1]), B_BODY + scale[5] * np.array([0, 1e-5, 0])
        return ALL[name](craft_with(inertia, magnet, moments), around(position, b_field))

    value = jax.jit(torque)
    slope = np.asarray(jax.jit(jax.jacfwd(torque))(jnp.zeros(6)))
    reverse = np.asarray(jax.jit(jax.jacrev(torque))(jnp.zeros(6)))
    h = 1e-4
    moved = [[np.asarray(value(jnp.asarray(s * h * np.eye(6)[k]))) for s in (1, -1)] for k in range(6)]
    difference = np.stack([(plus - minus) / (2 * h) for plus, minus in moved], axis=-1)
    assert np.count_nonzero(np.any(difference != 0, axis=0)) == {"gravity": 3, "magnet": 2, "rods": 2}[name]
    np.testing.assert_allclose(slope, difference, atol=1e-7 * np.abs(difference).max())
    np.testing.assert_allclose(reverse, slope, atol=1e-13 * np.abs(slope).max())


@pytest.mark.parametrize("name", ALL)
def test_slopes_are_finite_at_rest_in_no_field(name):
    slope = jax.jit(jax.jacfwd(lambda place: ALL[name](craft_with(), place)))(around(b_field=np.zeros(3)))
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(slope))


move = eqx.filter_jit(simulate_on_grid)


def swing(craft, torques, *, attitude, rate, position, b_field, duration, steps=600):
    """Attitudes (scipy) at 40 equal times from t = 0, with the environment given by NumPy functions of time."""
    times = np.linspace(0.0, duration, 41)
    grid = StepGrid.through(times[1:], start=0.0, max_step=duration / steps)
    nodes = np.asarray(grid.node_times)
    table = OrbitTable(jnp.asarray(position(nodes)), jnp.asarray(b_field(nodes)))
    initial = AttitudeState(jnp.asarray(attitude.as_quat(scalar_first=True)), jnp.asarray(rate))
    motion = move(craft, initial, table, grid, torques=torques)
    return times[1:], Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True)


def frequency(times, x):
    """Of samples of one sinusoid: x[k+1] + x[k-1] = 2 cos(w h) x[k]."""
    cosine = x[1:-1] @ (x[2:] + x[:-2]) / (2 * x[1:-1] @ x[1:-1])
    return np.arccos(cosine) / (times[1] - times[0])


def constant(vector):
    return lambda t: np.tile(vector, (len(t), 1))


def test_gravity_gradient_restores_an_elongated_body_to_the_vertical():
    # Circular orbit in the x-y plane; body z starts near the vertical, body y along the orbit's normal.
    r, amplitude = 7.0e6, 0.01
    n = np.sqrt(MU / r**3)
    jx, jy, jz = 0.06, 0.055, 0.02
    vertical_frame = Rotation.from_matrix(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    times, attitudes = swing(
        craft_with(np.diag([jx, jy, jz])),
        (GravityGradient(),),
        attitude=vertical_frame * Rotation.from_rotvec([0.0, amplitude, 0.0]),
        rate=[0.0, n, 0.0],
        position=lambda t: r * np.stack([np.cos(n * t), np.sin(n * t), 0 * t], axis=1),
        b_field=constant(np.zeros(3)),
        duration=2 * 2 * np.pi / n,
    )
    along = attitudes.apply([0.0, 0.0, 1.0])
    up = np.stack([np.cos(n * times), np.sin(n * times), 0 * times], axis=1)
    pitch = np.arcsin(np.cross(up, along)[:, 2])
    # The body never leaves the vertical by more than it started with, and comes back to the other side.
    assert 0.99 * amplitude < np.max(pitch) < 1.001 * amplitude
    assert -1.001 * amplitude < np.min(pitch) < -0.98 * amplitude
    assert np.min(np.sum(up * along, axis=1)) > np.cos(1.001 * amplitude)
    # Amplitude shortens the frequency by (2 x 0.01)^2 / 16 = 2.5e-5.
    assert frequency(times, pitch) == pytest.approx(n * np.sqrt(3 * (jx - jz) / jy), rel=1e-3)


def test_magnet_turns_toward_the_field_and_swings_about_it():
    moment, inertia, field = 0.3, 0.053, 3e-5
    expected = np.sqrt(moment * field / inertia)
    times, attitudes = swing(
        craft_with(inertia * np.eye(3), np.array([moment, 0, 0])),
        (PermanentMagnet(),),
        attitude=Rotation.from_rotvec([0.0, 0.0, 0.02]),
        rate=[0.0, 0.0, 0.0],
        position=constant(np.array([7e6, 0, 0])),
        b_field=constant(np.array([field, 0, 0])),
        duration=4 * 2 * np.pi / expected,
    )
    off = np.arctan2(*attitudes.apply([1.0, 0, 0]).T[1::-1])
    assert np.max(np.abs(off)) < 0.02 * 1.0001
    # Amplitude shortens the frequency by 0.02^2 / 16 = 2.5e-5.
    assert frequency(times, off) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("along", [0.0, np.pi])
def test_rod_swings_about_the_field_whichever_end_leads(along):
    moment, inertia, field = 0.03, 0.053, 4e-5
    expected = np.sqrt(moment * field**2 / REFERENCE / inertia)
    times, attitudes = swing(
        craft_with(inertia * np.eye(3), np.zeros(3), np.array([moment, 0.0]), np.eye(3)[1:]),
        (LinearRodsTorque(),),
        attitude=Rotation.from_rotvec([0.02 + along, 0.0, 0.0]),
        rate=[0.0, 0.0, 0.0],
        position=constant(np.array([7e6, 0, 0])),
        b_field=constant(np.array([0, field, 0])),
        duration=4 * 2 * np.pi / expected,
    )
    leading = np.cos(along) * attitudes.apply([0.0, 1.0, 0.0])
    off = np.arctan2(leading[:, 2], leading[:, 1])
    assert np.max(np.abs(off)) < 0.02 * 1.0001
    # The potential is that of a pendulum at twice the angle: (2 x 0.02)^2 / 16 = 1e-4.
    assert frequency(times, off) == pytest.approx(expected, rel=3e-4)


def test_magnetic_torques_are_the_slope_of_energy():
    """Torque about e = -dU/d(angle), U = -m.B - sum m_k (B.e_k)^2 / (2 B_ref): lowest with magnet and rods along B."""

    def energy(turn):
        b_field = Rotation.from_rotvec(turn).inv().apply(B_BODY)
        return -MAGNET @ b_field - 0.5 * np.sum(MOMENTS * (AXES @ b_field) ** 2) / REFERENCE

    h = 1e-5
    slope = [(energy(h * axis) - energy(-h * axis)) / (2 * h) for axis in np.eye(3)]
    torque = PermanentMagnet()(craft_with(), around()) + LinearRodsTorque()(craft_with(), around())
    # Truncation h^2 and rounding eps / h, of 1e-5 J.
    np.testing.assert_allclose(torque, -np.array(slope), atol=1e-9 * 1e-5 * 10)
