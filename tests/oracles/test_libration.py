"""Librations under gravity gradient on a circular orbit against linear theory, the pendulum, and published frequencies.

The satellite is that of Somov et al. 2018, which stands on its axis of least inertia.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import DORMAND_PRINCE_8, StepGrid
from jaxsat.math import quaternion
from jaxsat.simulate import simulate, simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import GravityGradient, PermanentMagnet

MU, RADIUS = 3.986004415e14, 6378.1363e3 + 720e3
N = np.sqrt(MU / RADIUS**3)
ORBIT = 2 * np.pi / N
ALONG, MINUS_NORMAL, DOWN = 9450.0, 11450.0, 7150.0
"""Moments about roll, pitch and yaw axes in the stable attitude [kg m^2] (Somov et al. 2018, sec. 5)."""
PUBLISHED = {"pitch": 0.776286, "roll-yaw, fast": 1.505944, "roll-yaw, slow": 0.473807}
"""Over the orbital rate (papers/NOTES.md, sec. 3), to half a unit of the last digit."""
TILT = Rotation.from_rotvec([0.4, -0.9, 0.6])
"""Orbit's frame at t = 0 in inertial axes: a generic plane and phase."""
BODY = Rotation.from_rotvec([-0.5, 0.3, 0.9])
"""Principal axes (along, minus normal, down) in body axes: askew, so that products of inertia take part."""
TORQUES = (GravityGradient(), PermanentMagnet())


class Circle(eqx.Module):
    """The orbit, in a constant field."""

    b_field_eci: jax.Array

    def __call__(self, times):
        c, s, zero = jnp.cos(N * times), jnp.sin(N * times), jnp.zeros_like(times)
        position = RADIUS * jnp.stack([c, s, zero], axis=1) @ TILT.as_matrix().T
        return OrbitTable(position, jnp.broadcast_to(self.b_field_eci, position.shape))


NO_FIELD = Circle(jnp.zeros(3))


def orbit_frame(t):
    """Axes along the velocity, against the orbit's normal and down, inertial from orbital."""
    at_zero = Rotation.from_matrix(np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]))
    return TILT * Rotation.from_rotvec(np.multiply.outer(N * np.asarray(t), [0.0, 0.0, 1.0])) * at_zero


def craft_with(moments, magnet=(0.0, 0.0, 0.0)):
    inertia = BODY.as_matrix() @ np.diag(moments) @ BODY.as_matrix().T
    rods = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    return Spacecraft(jnp.asarray(inertia), jnp.asarray(np.asarray(magnet)), rods, panels)


def start(turn, rate):
    """State turned from the orbital attitude by a rotation vector and moving against it at a rate, principal axes."""
    attitude = orbit_frame(0.0) * Rotation.from_rotvec(turn) * BODY.inv()
    carried = attitude.inv().apply(TILT.apply([0.0, 0.0, N]))
    return AttitudeState(
        jnp.asarray(attitude.as_quat(scalar_first=True)), jnp.asarray(BODY.apply(np.asarray(rate)) + carried)
    )


def linear_theory(along, minus_normal, down):
    """d/dt (roll, pitch, yaw, and their rates over n) over n (Hughes 2004, ch. 9; Wie 2008, ch. 6)."""
    coupling = along - minus_normal + down
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = np.eye(3)
    matrix[3, [0, 5]] = np.array([-4.0 * (minus_normal - down), coupling]) / along
    matrix[4, 1] = -3.0 * (along - down) / minus_normal
    matrix[5, [2, 3]] = np.array([-(minus_normal - along), -coupling]) / down
    return matrix


GRID = jax.tree.map(
    jnp.asarray, StepGrid.through(np.array([ORBIT]), start=0.0, max_step=ORBIT / 256, tableau=DORMAND_PRINCE_8)
)
TABLE = eqx.filter_jit(NO_FIELD)(GRID.node_times)


@eqx.filter_jit
def monodromy(craft):
    """Derivative of turn and rate (over n) against the orbital attitude after one orbit by those before, [6, 6]."""
    axes, normal = jnp.asarray(BODY.as_matrix()), jnp.asarray(TILT.apply([0.0, 0.0, N]))
    rest = jnp.asarray((orbit_frame(0.0) * BODY.inv()).as_quat(scalar_first=True))

    def after(x):
        q = quaternion.multiply(rest, quaternion.from_rotation_vector(axes @ x[:3]))
        state = AttitudeState(q, axes @ (N * x[3:]) + quaternion.rotate_inverse(q, normal))
        motion = simulate_on_grid(craft, state, TABLE, GRID, torques=TORQUES, tableau=DORMAND_PRINCE_8)
        q, w = motion.quaternion[0], motion.angular_velocity[0]
        turn = quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(rest), q))
        return jnp.concatenate([turn @ axes, (w - quaternion.rotate_inverse(q, normal)) @ axes / N])

    return jax.jacfwd(after)(jnp.zeros(6))


SATELLITE = (ALONG, MINUS_NORMAL, DOWN)
ATTITUDES = {
    "on end": (SATELLITE, True),
    "long axis along track": ((DOWN, MINUS_NORMAL, ALONG), False),
    "long axis across": ((ALONG, DOWN, MINUS_NORMAL), False),
    "flat, long axis up": ((MINUS_NORMAL, ALONG, DOWN), False),
    "flat, long axis along track": ((DOWN, ALONG, MINUS_NORMAL), False),
    "on edge, long axis across": ((MINUS_NORMAL, DOWN, ALONG), False),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ATTITUDES)
def test_linear_motion_about_each_equilibrium(name):
    """All of the linear theory, in one matrix: its 36 elements after an orbit, stable or not."""
    moments, stable = ATTITUDES[name]
    found = np.asarray(monodromy(craft_with(moments)))
    expected = expm(2 * np.pi * linear_theory(*moments))
    # 256 steps of 1.4 degrees: the method and rounding leave 5e-13.
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-12 * np.abs(expected).max())
    assert (np.abs(np.linalg.eigvals(found)).max() < 1.0 + 1e-8) == stable


def frequencies_of(moments):
    """Of the characteristic equations of the linear theory, over n."""
    along, minus_normal, down = moments
    k1, k3 = (minus_normal - down) / along, (minus_normal - along) / down
    squares = np.roots([1.0, -(1.0 + 3.0 * k1 + k1 * k3), 4.0 * k1 * k3])
    return np.sqrt(np.array([3.0 * (along - down) / minus_normal, *np.sort(squares)[::-1]]))


@pytest.mark.slow
def test_published_frequencies_by_the_monodromy():
    np.testing.assert_allclose(frequencies_of(SATELLITE), list(PUBLISHED.values()), rtol=0, atol=5e-7)
    found = np.linalg.eigvals(np.asarray(monodromy(craft_with(SATELLITE))))
    for value in PUBLISHED.values():
        # Half a unit of the last published digit, over one turn of the orbit.
        assert np.min(np.abs(found - np.exp(2j * np.pi * value))) < 2 * np.pi * 5e-7


TIMES = ORBIT / 32 * np.arange(1, 161)
TOLERANCE = 1e-10
"""Of the attitude [rad]; 2000 steps round it to 1e-13, and the fall from the horizontal makes 3e-11 of that."""


def librate(turn, rate=(0.0, 0.0, 0.0), moments=SATELLITE):
    """Rotation vectors of the principal axes against the orbit's frame over five orbits, [samples, 3]."""
    motion = simulate(craft_with(moments), start(turn, rate), NO_FIELD, TIMES, torques=TORQUES, tolerance=TOLERANCE)
    found = Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True)
    return (orbit_frame(TIMES).inv() * found * BODY).as_rotvec()


def frequencies(x, h, count):
    """Of samples of `count` sinusoids, 1 or 2: x[k+m] + x[k-m] = 2 sum of cos(m w h) parts, solved by least squares."""
    near, far, middle = x[3:-1] + x[1:-3], x[4:] + x[:-4], x[2:-2]
    if count == 1:
        cosines = np.array([0.5 * (near @ middle) / (middle @ middle)])
    else:
        a, b = np.linalg.lstsq(np.stack([near, middle], axis=1), far, rcond=None)[0]
        cosines = np.roots([4.0, -2.0 * a, -2.0 - b])
    return np.sort(np.arccos(cosines))[::-1] / h


@pytest.mark.slow
def test_published_frequencies_by_five_orbits():
    # Waves of second order are 1e-5 of those of the first, and their frequencies are others.
    librations = librate([1e-5, -7e-6, 3e-6], rate=[3e-6 * N, 7e-6 * N, -3e-6 * N])
    roll, pitch, yaw = librations[3::4].T
    expected = frequencies_of(SATELLITE)
    h = 2 * np.pi / 8
    np.testing.assert_allclose(frequencies(pitch, h, 1), expected[:1], rtol=2e-6)
    np.testing.assert_allclose(frequencies(roll, h, 2), expected[1:], rtol=2e-6)
    np.testing.assert_allclose(frequencies(yaw, h, 2), expected[1:], rtol=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [0.1, 0.5, 1.0])
def test_large_pitch_libration_is_a_pendulum_at_twice_the_angle(amplitude):
    """theta'' = -(w^2/2) sin 2 theta, so sin theta = k sn(w t + K, k) with k the sine of the amplitude."""
    w, k = frequencies_of(SATELLITE)[0], np.sin(amplitude)
    turn = librate([0.0, amplitude, 0.0])
    sn = ellipj(w * N * TIMES + ellipk(k**2), k**2)[0]
    np.testing.assert_allclose(turn[:, 1], np.arcsin(k * sn), rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(turn[:, [0, 2]], 0.0, rtol=0, atol=TOLERANCE)


@pytest.mark.slow
def test_long_axis_falls_from_the_horizontal_and_swings_through_the_vertical():
    """The same pendulum, let go 0.05 rad from its top."""
    small = 0.05
    w, k = frequencies_of(SATELLITE)[0], np.cos(small)
    turn = librate([0.0, small, 0.0], moments=(DOWN, MINUS_NORMAL, ALONG))
    fallen = 0.5 * np.pi - np.arcsin(k * ellipj(w * N * TIMES + ellipk(k**2), k**2)[0])
    np.testing.assert_allclose(turn[:, 1], fallen, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(turn[:, [0, 2]], 0.0, rtol=0, atol=TOLERANCE)
    # Outward at first, as cosh while (2 theta)^2 / 6 is small, and on to the other horizontal.
    early = TIMES < 0.2 * ORBIT
    np.testing.assert_allclose(turn[early, 1], small * np.cosh(w * N * TIMES[early]), rtol=1e-3)
    assert turn[:, 1].max() > 3.0


def test_magnet_turns_toward_the_field():
    """A body of equal moments, which feels no gravity gradient, swings from rest as a pendulum about the field."""
    moment, strength, inertia = 150.0, 3e-5, 1e4
    magnet, field = moment * np.array([0.36, 0.48, 0.8]), strength * np.array([1, -2, 2]) / 3
    rest = AttitudeState(start([0.3, 1.2, -0.5], np.zeros(3)).quaternion, jnp.zeros(3))
    place = Circle(jnp.asarray(field))
    motion = simulate(craft_with(3 * [inertia], magnet), rest, place, TIMES, torques=TORQUES, tolerance=TOLERANCE)

    q = np.concatenate([rest.quaternion[None], motion.quaternion])
    dipole = Rotation.from_quat(q, scalar_first=True).apply(magnet)
    axis = np.cross(dipole[0], field) / np.linalg.norm(np.cross(dipole[0], field))
    # From the dipole to the field about the axis that brings them together; it stays in that plane.
    angle = np.arctan2(np.cross(dipole, field) @ axis, dipole @ field)
    np.testing.assert_allclose(dipole @ axis, 0.0, rtol=0, atol=TOLERANCE * moment)
    k, w = np.sin(0.5 * angle[0]), np.sqrt(moment * strength / inertia)
    sn = ellipj(w * TIMES + ellipk(k**2), k**2)[0]
    np.testing.assert_allclose(angle[1:], 2.0 * np.arcsin(k * sn), rtol=0, atol=TOLERANCE)
    assert np.all(np.diff(angle[: np.argmax(angle < 0.0)]) < 0.0)
