"""Attitude motions that have closed forms: the free rigid body, a magnet's pendulum, and a magnet's spinning top."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk, ellipkinc

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.simulate import simulate
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import PermanentMagnet

TORQUES = (PermanentMagnet(),)
"""In all tests, so that they share one program; a dipole of zero leaves the body free to the last bit."""
SCALE = 85.0
"""Motions last this many radians of their fastest rate: 13 turns."""
PARTS = np.array([0.04, 0.11, 0.2, 0.29, 0.37, 0.45, 0.5, 0.61, 0.72, 0.83, 0.94, 1.0])
"""Irregular sample times over the duration."""
TOLERANCE = 1e-10
"""Of the attitude [rad], a hundred times what rounding makes of it: 3000 steps round rate and quaternion by 1e-16 of
themselves each, and an error in the rate turns the body away for up to 85 rad."""


class Still(eqx.Module):
    """A far place in a constant field."""

    b_field_eci: jax.Array

    def __call__(self, times):
        shape = (times.shape[0], 3)
        return OrbitTable(
            jnp.broadcast_to(jnp.asarray([1e9, 0.0, 0.0]), shape), jnp.broadcast_to(self.b_field_eci, shape)
        )


def follow(inertia, q0, w0, times, magnet=(0.0, 0.0, 0.0), b_field=(0.0, 0.0, 0.0), start=0.0, tolerance=TOLERANCE):
    """Attitudes (scipy) and rates at the times."""
    rods = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    craft = Spacecraft(jnp.asarray(inertia), jnp.asarray(np.asarray(magnet)), rods, panels)
    initial = AttitudeState(jnp.asarray(q0.as_quat(scalar_first=True)), jnp.asarray(w0))
    place = Still(jnp.asarray(np.asarray(b_field)))
    motion = simulate(craft, initial, place, times, start=start, torques=TORQUES, tolerance=tolerance)
    # Two runs were compared: they never agree to the last bit.
    assert motion.error is not None and 0.0 < motion.error < tolerance
    return Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True), np.asarray(motion.angular_velocity)


def apart(found, expected):
    return np.max((found.inv() * expected).magnitude())


Q0 = Rotation.from_rotvec([0.7, -1.1, 0.4])
# Principal axes askew in the body, so that products of inertia take part.
TILT = Rotation.from_rotvec([-0.5, 0.3, 0.9])


def tensor(moments):
    return TILT.as_matrix() @ np.diag(moments) @ TILT.as_matrix().T


def free_body(moments, w0):
    """Rates in principal axes as functions of time, in Jacobi's functions (Landau & Lifshitz 1976, sec. 37).

    `moments` ascend, and the first and last of `w0` are positive. Where the polhode goes round the axis of least
    inertia, the first and third axes change places.
    """
    twice_energy, momentum_squared = moments @ w0**2, moments**2 @ w0**2
    order = np.array([0, 1, 2] if momentum_squared >= twice_energy * moments[1] else [2, 1, 0])
    a, b, c = moments[order]
    low, high = momentum_squared - twice_energy * a, twice_energy * c - momentum_squared
    size = np.sqrt([high / (a * (c - a)), high / (b * (c - b)), low / (c * (c - a))])
    rate = np.sqrt((c - b) * low / (a * b * c))
    # On the separatrix the modulus is one, but for rounding.
    modulus = min((b - a) * high / ((c - b) * low), 1.0)
    phase = ellipkinc(np.arctan2(w0[1] / size[1], w0[order[0]] / size[0]), modulus)

    def rates(t):
        sn, cn, dn, _ = ellipj(rate * t + phase, modulus)
        return (size * np.stack([cn, sn, dn], axis=-1))[..., order]

    return rates


def attitudes_of(moments, rates, times):
    """Attitudes of principal axes against one whose z axis is along the momentum M (Landau & Lifshitz 1976, sec. 37).

    Euler's angles: M (sin theta sin psi, sin theta cos psi, cos theta) = J w, and the precession is the integral of
    phi' = M (J1 w1^2 + J2 w2^2) / (J1^2 w1^2 + J2^2 w2^2).
    """
    size = np.linalg.norm(moments * rates(0.0))

    def precession_rate(t):
        w = rates(t)
        return size * (moments[:2] @ w[:2] ** 2) / (moments[:2] ** 2 @ w[:2] ** 2)

    phi = np.cumsum([quad(precession_rate, s, t, epsabs=1e-13)[0] for s, t in zip(times[:-1], times[1:], strict=True)])
    along = moments * rates(times) / size
    theta = np.arctan2(np.hypot(along[:, 0], along[:, 1]), along[:, 2])
    psi = np.arctan2(along[:, 0], along[:, 1])
    return Rotation.from_euler("ZXZ", np.stack([np.concatenate([[0.0], phi]), theta, psi], axis=1))


MUNIN_LIKE = np.array([0.050, 0.055, 0.060])
# J1 (J2 - J1) w1^2 = J3 (J3 - J2) w3^2: from near one end of the middle axis once over to near the other.
SEPARATRIX = np.array([0.0012, -0.022, 0.0012 * np.sqrt(5 / 6)])
FREE = {
    "about the axis of least inertia": (np.array([0.02, 0.05, 0.06]), np.array([0.03, 0.02, 0.009]), 1),
    "about the axis of greatest inertia": (np.array([0.02, 0.05, 0.06]), np.array([0.012, -0.018, 0.025]), 1),
    "backward in time": (MUNIN_LIKE, np.array([0.02, 0.01, 0.021]), -1),
    "near the separatrix": (MUNIN_LIKE, np.array([0.02, 0.003, 0.0183]), 1),
    "over on the separatrix": (MUNIN_LIKE, SEPARATRIX, 1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FREE)
def test_free_tumbling(name):
    moments, w0, direction = FREE[name]
    times = direction * SCALE / np.linalg.norm(w0) * PARTS
    rates = free_body(moments, w0)
    principal = attitudes_of(moments, rates, np.concatenate([[0.0], times]))
    expected = Q0 * TILT * principal[0].inv() * principal[1:] * TILT.inv()

    found, found_rates = follow(tensor(moments), Q0, TILT.apply(w0), times)

    assert apart(found, expected) < TOLERANCE
    np.testing.assert_allclose(
        found_rates, TILT.apply(rates(times)), rtol=0, atol=TOLERANCE * float(np.linalg.norm(w0))
    )
    # A large tumbling: every rate in principal axes changes by much.
    assert np.all(np.ptp(rates(times), axis=0) > 0.1 * np.linalg.norm(w0))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.06, 1e-4], ids=["24 minutes", "10 days"])
@pytest.mark.parametrize("axial", [0.03, 0.09], ids=["prolate", "oblate"])
def test_free_precession_of_a_symmetric_body(axial, rate):
    """Turn about h at |h|/J_t after a turn about the body's axis at w_z (1 - J_z/J_t) (Goldstein 1980, sec. 5-6)."""
    transverse, w0 = 0.05, rate * np.array([0.6, -0.3, 0.7])
    start = 1000.0
    times = start + SCALE / rate * PARTS
    found, rates = follow(tensor([transverse, transverse, axial]), Q0, TILT.apply(w0), times, start=start)

    elapsed = (times - start)[:, None]
    momentum = (Q0 * TILT).apply(np.array([transverse, transverse, axial]) * w0)
    spin = np.array([0.0, 0.0, w0[2] * (1 - axial / transverse)])
    precession = Rotation.from_rotvec(elapsed * momentum / transverse)
    expected = precession * Q0 * TILT * Rotation.from_rotvec(elapsed * spin) * TILT.inv()
    assert apart(found, expected) < TOLERANCE
    expected_rates = TILT.apply(Rotation.from_rotvec(-elapsed * spin).apply(w0))
    np.testing.assert_allclose(rates, expected_rates, rtol=0, atol=TOLERANCE * rate)


MOMENT, FIELD = 0.3, 3e-5
SWINGING = np.array([0.05, 0.06, 0.06])
"""The magnet lies along the axis of symmetry: large planar swings of a body with three different moments are unstable
against motion out of the plane, which rounding would start."""


def pendulum(modulus):
    """Angle and rate of theta'' = -w0^2 sin theta over phase w0 t, and the period in phase; beyond 1 it turns over.

    theta = 2 asin(k sn(w0 t, k)); or 2 am(k w0 t, 1/k) (Landau & Lifshitz 1976, sec. 11).
    """
    if modulus < 1.0:

        def at(phase):
            sn, cn, _, _ = ellipj(phase, modulus**2)
            return 2.0 * np.arcsin(modulus * sn), 2.0 * modulus * cn

        return at, 4.0 * ellipk(modulus**2)

    def over(phase):
        _, _, dn, am = ellipj(modulus * phase, modulus**-2)
        return 2.0 * am, 2.0 * modulus * dn

    return over, 2.0 * ellipk(modulus**-2) / modulus


@pytest.mark.slow
@pytest.mark.parametrize(
    ("modulus", "tolerance", "length"),
    [
        (np.sin(0.005), TOLERANCE, SCALE),
        (np.sin(0.6), TOLERANCE, SCALE),
        (np.sin(1.25), TOLERANCE, SCALE),
        # The time spent near the top depends on the energy so much that rounding weighs a hundred times more.
        (np.sin(1.55), 1e-8, SCALE),
        (1.02, TOLERANCE, SCALE),
        (2.0, TOLERANCE, SCALE),
        # Steps that accuracy allows but stability does not would show.
        (np.sin(0.6), 1e-3, 1000.0),
        (2.0, 1e-5, 1000.0),
    ],
    ids=["0.01 rad", "1.2 rad", "2.5 rad", "3.1 rad", "just over", "round and round", "long and loose", "long"],
)
def test_pendulum_of_a_magnet(modulus, tolerance, length):
    at, period = pendulum(modulus)
    swing_rate = np.sqrt(MOMENT * FIELD / SWINGING[2])
    phase = 0.3 * period
    angle, rate = at(phase)
    duration = length / swing_rate / np.sqrt(rate**2 + 2 * SWINGING[2] / SWINGING[0])
    periods = period / swing_rate * np.floor(duration * swing_rate / period * np.array([0.5, 1.0]))
    times = np.sort(np.concatenate([duration * PARTS[1:-1], periods]))
    along_field = Q0 * TILT

    found, rates = follow(
        tensor(SWINGING),
        along_field * Rotation.from_rotvec([0.0, 0.0, angle]) * TILT.inv(),
        TILT.apply([0.0, 0.0, swing_rate * rate]),
        times,
        magnet=TILT.apply([MOMENT, 0.0, 0.0]),
        b_field=along_field.apply([FIELD, 0.0, 0.0]),
        tolerance=tolerance,
    )

    angles, angle_rates = at(phase + swing_rate * times)
    expected = along_field * Rotation.from_rotvec(np.outer(angles, [0.0, 0.0, 1.0])) * TILT.inv()
    assert apart(found, expected) < tolerance
    expected_rates = swing_rate * TILT.apply(np.outer(angle_rates, [0.0, 0.0, 1.0]))
    np.testing.assert_allclose(rates, expected_rates, rtol=0, atol=tolerance * swing_rate)
    # The period is 4 K(k) / w0; it does not rest on the angle's formula.
    start = along_field * Rotation.from_rotvec([0.0, 0.0, angle]) * TILT.inv()
    after = Rotation.from_quat(found.as_quat()[np.isin(times, periods)])
    assert apart(after, start) < tolerance


@pytest.mark.slow
@pytest.mark.parametrize(("tilt", "precession"), [(0.5, 0.01), (2.4, 0.02), (1.1, -0.03)])
def test_steady_precession_of_a_magnetic_top(tilt, precession):
    """A dipole m along the axis of a symmetric body precesses at W about the field, at an angle theta, if it spins with

    J_z w_z = J_t W cos theta - m B / W: a heavy top (Goldstein 1980, eq. 5-76) whose weight pulls upward.
    """
    transverse, axial = 0.05, 0.03
    w_axial = (transverse * precession * np.cos(tilt) - MOMENT * FIELD / precession) / axial
    spin = w_axial - precession * np.cos(tilt)
    w0 = np.array([0.0, precession * np.sin(tilt), w_axial])
    fastest = np.sqrt(w0 @ w0 + 2 * MOMENT * FIELD / axial)
    times = SCALE / fastest * PARTS

    def attitude(t):
        angles = np.stack([precession * t, tilt + 0 * t, spin * t], axis=-1)
        return Q0 * Rotation.from_euler("ZXZ", angles) * TILT.inv()

    found, _ = follow(
        tensor([transverse, transverse, axial]),
        attitude(np.array(0.0)),
        TILT.apply(w0),
        times,
        magnet=TILT.apply([0.0, 0.0, MOMENT]),
        b_field=Q0.apply([0.0, 0.0, FIELD]),
    )
    assert apart(found, attitude(times)) < TOLERANCE
