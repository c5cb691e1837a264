"""Attitude under all torques against scipy's DOP853, with orbit, field and equations of motion written in NumPy."""

import datetime

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import CentredDipole, igrf_field, orbit_from_perigee_time_km_deg
from jaxsat.environment.surroundings import Surroundings
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate, simulate_many, simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals

MU, EARTH_RATE, GREENWICH_0 = 3.986004415e14, 2 * np.pi * 1.002737909350795 / 86400, 3.3376043416205383
A, E, INCLINATION, NODE, PERIGEE = 7630.026457e3, 0.072661, *np.radians([95.438873, 64.81879, 16.675906])
T_PERIGEE = 3230.533197
ECI_FROM_PERIFOCAL = Rotation.from_euler("ZXZ", [NODE, INCLINATION, PERIGEE]).as_matrix()
ORBIT = orbit_from_perigee_time_km_deg(
    a_km=A / 1e3,
    e=E,
    i_deg=np.degrees(INCLINATION),
    raan_deg=np.degrees(NODE),
    argp_deg=np.degrees(PERIGEE),
    t_perigee_s=T_PERIGEE,
)
DIPOLE = 7.77e22 * np.array([0.06, -0.17, -0.98])
"""Of the Earth, Earth-fixed [A m^2]."""
MOMENTS, REFERENCE = np.array([0.035, 0.025]), 3.0e-5
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.28, 0.96]])


def position_at(t):
    """Kepler's equation by Newton's method, and the three rotations of the orbital plane, [times, 3]."""
    mean = np.sqrt(MU / A**3) * (t - T_PERIGEE)
    ecc = mean
    for _ in range(6):
        ecc = ecc - (ecc - E * np.sin(ecc) - mean) / (1 - E * np.cos(ecc))
    plane = A * np.stack([np.cos(ecc) - E, np.sqrt(1 - E**2) * np.sin(ecc), 0 * ecc], axis=-1)
    return plane @ ECI_FROM_PERIFOCAL.T


def dipole_at(t):
    """Field of the tilted dipole that turns with the Earth, inertial [T]."""
    r = position_at(t)
    angle = GREENWICH_0 + EARTH_RATE * t
    c, s = np.cos(angle), np.sin(angle)
    m = np.stack([c * DIPOLE[0] - s * DIPOLE[1], s * DIPOLE[0] + c * DIPOLE[1], DIPOLE[2] + 0 * t], axis=-1)
    size = np.linalg.norm(r, axis=-1, keepdims=True)
    return 1e-7 * (3 * np.sum(m * r, axis=-1, keepdims=True) * r / size**2 - m) / size**3


def burst(t, growth, xp=np):
    """Factor on the field: it grows for some minutes."""
    return 1.0 + growth * xp.exp(-(((t - 500.0) / 100.0) ** 2))


class Place(eqx.Module):
    """The orbit in the dipole's field."""

    growth: jax.Array
    surroundings: Surroundings

    def __call__(self, times):
        table = self.surroundings(times)
        strength = burst(times, self.growth, jnp)
        return eqx.tree_at(lambda t: t.b_field_eci, table, strength[:, None] * table.b_field_eci)


def place(growth=0.0):
    return Place(jnp.asarray(growth), Surroundings(ORBIT, CentredDipole(DIPOLE), GREENWICH_0))


class Cases:
    """Satellites and their first states, in NumPy."""

    def __init__(self, seed, spins):
        rng, n = np.random.default_rng(seed), len(spins)
        axes = Rotation.random(n, rng=rng).as_matrix()
        self.inertia = axes @ (rng.uniform(0.04, 0.07, (n, 3))[:, :, None] * axes.swapaxes(1, 2))
        self.magnet = 0.15 * rng.normal(size=(n, 3))
        self.q = Rotation.random(n, rng=rng).as_quat(scalar_first=True)
        self.w = np.asarray(spins)[:, None] * Rotation.random(n, rng=rng).apply([1.0, 0, 0])

    def truth(self, spans, parts, field=dipole_at):
        """Attitudes and rates [cases, samples, ...] at the parts of each case's span, all cases in one solution."""
        inverse, (n, spans) = np.linalg.inv(self.inertia), (len(self.q), np.broadcast_to(spans, len(self.q)))

        def slope(tau, y):
            q, w = y.reshape(n, 7)[:, :4], y.reshape(n, 7)[:, 4:]
            body_from_eci = Rotation.from_quat(q, scalar_first=True).inv()
            r, b = body_from_eci.apply(position_at(tau * spans)), body_from_eci.apply(field(tau * spans))
            dipole = self.magnet + (MOMENTS * (b @ AXES.T) / REFERENCE) @ AXES
            size = np.linalg.norm(r, axis=1, keepdims=True)
            torque = 3 * MU / size**5 * np.cross(r, product(self.inertia, r)) + np.cross(dipole, b)
            w_dot = product(inverse, torque - np.cross(w, product(self.inertia, w)))
            x, y, z = w.T
            omega = np.array([[0 * x, -x, -y, -z], [x, 0 * x, z, -y], [y, -z, 0 * x, x], [z, y, -x, 0 * x]])
            q_dot = 0.5 * product(omega.transpose(2, 0, 1), q)
            return (spans[:, None] * np.concatenate([q_dot, w_dot], axis=1)).ravel()

        start = np.concatenate([self.q, self.w], axis=1).ravel()
        solution = solve_ivp(slope, (0, 1), start, method="DOP853", t_eval=parts, rtol=1e-13, atol=1e-15)
        assert solution.success
        states = solution.y.T.reshape(len(parts), n, 7).swapaxes(0, 1)
        return states[..., :4], states[..., 4:]


def product(tensors, vectors):
    return np.einsum("nij,nj->ni", tensors, vectors)


def craft_with(inertia, magnet):
    rods = MagneticRods(jnp.asarray(MOMENTS), jnp.asarray(AXES), jnp.asarray(REFERENCE))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    return Spacecraft(jnp.asarray(inertia), jnp.asarray(magnet), rods, panels)


def state(q, w):
    return AttitudeState(jnp.asarray(q), jnp.asarray(w))


def angle(found, expected):
    """Largest angle between attitudes [..., 4]."""
    a, b = (Rotation.from_quat(np.asarray(q).reshape(-1, 4), scalar_first=True) for q in (found, expected))
    return np.max((a.inv() * b).magnitude())


SPINS = [0.001, 0.003, 0.01, 0.02, 0.04, 0.1, 0.3, 0.0]
PARTS = np.sort(np.random.default_rng(3).uniform(0.02, 1.0, 20))
# Radians of a motion's own rate at a tolerance: a run and its coarser one take between 512 and 1024 steps, or twice as
# many where a second attempt is needed, and so share two programs.
LENGTHS = {1e-7: 64.0, 1e-9: 44.0}


def rate_scale(cases):
    swing = 2 * (np.linalg.norm(cases.magnet, axis=1) + MOMENTS.sum()) * np.linalg.norm(dipole_at(np.zeros(1)))
    return np.sqrt(np.sum(cases.w**2, axis=1) + swing / np.linalg.eigvalsh(cases.inertia)[:, 0])


@pytest.fixture(scope="module")
def motions():
    """Motions from slow to fast, the spans followed at each tolerance, and how the motions go at the parts of them."""
    cases = Cases(11, SPINS)
    longest = max(LENGTHS.values())
    parts = np.unique([length / longest * PARTS for length in LENGTHS.values()])
    attitudes, rates = cases.truth(longest / rate_scale(cases), parts)
    found = {}
    for tolerance, length in LENGTHS.items():
        at = np.searchsorted(parts, length / longest * PARTS)
        found[tolerance] = (length / rate_scale(cases), attitudes[:, at], rates[:, at])
    return cases, found


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", LENGTHS)
@pytest.mark.parametrize("k", range(len(SPINS)), ids=[f"{spin} rad per s" for spin in SPINS])
def test_tolerance_holds_from_slow_to_fast(motions, k, tolerance):
    cases, (spans, attitudes, rates) = motions[0], motions[1][tolerance]
    craft, times = craft_with(cases.inertia[k], cases.magnet[k]), spans[k] * PARTS
    motion = simulate(craft, state(cases.q[k], cases.w[k]), place(), times, tolerance=tolerance)
    assert angle(motion.quaternion, attitudes[k]) < tolerance
    np.testing.assert_allclose(motion.angular_velocity, rates[k], rtol=0, atol=tolerance * np.abs(rates[k]).max())
    # And back, from the last state to the first.
    last = state(attitudes[k, -1], rates[k, -1])
    earlier = np.append(times[-2::-1], 0.0)
    back = simulate(craft, last, place(), earlier, start=times[-1], tolerance=tolerance)
    assert angle(back.quaternion, [*attitudes[k, -2::-1], cases.q[k]]) < tolerance


@pytest.mark.slow
def test_tolerance_holds_where_the_motion_grows_fast_on_the_way():
    """Nothing at the start tells what step is needed: the comparison of two runs has to."""
    growth, cases = 10.0, Cases(17, [0.001])
    span = LENGTHS[1e-7] / rate_scale(cases)[0]
    attitudes, _ = cases.truth(span, PARTS, lambda t: burst(t, growth)[:, None] * dipole_at(t))
    craft, initial = craft_with(cases.inertia[0], cases.magnet[0]), state(cases.q[0], cases.w[0])
    calm, motion = (simulate(craft, initial, place(x), span * PARTS, tolerance=1e-7) for x in (0.0, growth))
    assert longest_step(motion) < longest_step(calm)
    assert angle(motion.quaternion, attitudes[0]) < 1e-7


def longest_step(motion):
    assert motion.grid is not None
    return np.max(np.abs(motion.grid.step))


# As above: between 256 and 512 steps.
SPAN = 1000.0
EVEN = np.linspace(0.05, 1.0, 20) * SPAN
UNEVEN = np.sort(np.random.default_rng(4).uniform(0.0, SPAN, 20))


@pytest.mark.slow
@pytest.mark.parametrize("shared", [True, False], ids=["one satellite", "each its own"])
def test_tolerance_holds_for_many_at_once(shared):
    """64 cases in four chunks: three quarters of them are not in the pilot that the step is chosen by."""
    cases = Cases(12, np.random.default_rng(6).uniform(0.0, 0.03, 64))
    if shared:
        cases.inertia[:], cases.magnet[:] = cases.inertia[0], cases.magnet[0]
        craft = craft_with(cases.inertia[0], cases.magnet[0])
    else:
        craft = jax.vmap(craft_with)(cases.inertia, cases.magnet)
    both = np.sort(np.concatenate([EVEN, UNEVEN]))
    attitudes, rates = cases.truth(SPAN, both / SPAN)
    initial = jax.vmap(state)(cases.q, cases.w)
    for times in (EVEN, UNEVEN):
        motion = simulate_many(craft, initial, place(), times, tolerance=1e-7, chunk=16)
        at = np.searchsorted(both, times)
        assert angle(motion.quaternion, attitudes[:, at]) < 1e-7
        np.testing.assert_allclose(motion.angular_velocity, rates[:, at], rtol=0, atol=1e-7 * np.abs(rates).max())
        assert motion.diverged == ()


@pytest.mark.slow
def test_second_oracle(motions):
    """diffrax's Dopri8, with the equations once more in its own words."""
    diffrax = pytest.importorskip("diffrax")
    cases, spans, k = motions[0], motions[1][1e-7][0], 4
    inertia, magnet, axes = cases.inertia[k], cases.magnet[k], jnp.asarray(AXES)
    times = spans[k] * PARTS

    def slope(t, y, _):
        (q0, q1, q2, q3), w = y[:4], y[4:]
        table = place()(t[None])
        e = jnp.asarray([[q0, -q3, q2], [q3, q0, -q1], [-q2, q1, q0]])
        body_from_eci = jnp.transpose(jnp.outer(y[1:4], y[1:4]) + e @ e)
        r, b = body_from_eci @ table.position_eci[0], body_from_eci @ table.b_field_eci[0]
        dipole = magnet + (MOMENTS * (axes @ b) / REFERENCE) @ axes
        torque = 3 * MU / jnp.linalg.norm(r) ** 5 * jnp.cross(r, inertia @ r) + jnp.cross(dipole, b)
        w_dot = jnp.linalg.solve(inertia, torque - jnp.cross(w, inertia @ w))
        return jnp.concatenate([0.5 * jnp.stack([-y[1:4] @ w, *(e @ w)]), w_dot])

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(slope),
        diffrax.Dopri8(),
        0.0,
        times[-1],
        None,
        jnp.asarray(np.concatenate([cases.q[k], cases.w[k]])),
        saveat=diffrax.SaveAt(ts=jnp.asarray(times)),
        stepsize_controller=diffrax.PIDController(rtol=1e-10, atol=1e-12),
        throw=False,
    )
    craft, initial = craft_with(inertia, magnet), state(cases.q[k], cases.w[k])
    motion = simulate(craft, initial, place(), times, tolerance=1e-7)
    assert angle(motion.quaternion, solution.ys[:, :4]) < 1e-7


@pytest.mark.slow
def test_thousand_seconds_in_the_main_field():
    """The IGRF as ppigrf has it, a noon: ppigrf dates the model by calendar day and hour, the year is no leap year."""
    ppigrf = pytest.importorskip("ppigrf")
    date, year = datetime.datetime(2001, 1, 18, 12), 2001 + 17.5 / 365
    # Cubic over 4 s, in which the field turns by some 0.01 rad at most: its error is below 0.01^4 / 384.
    t = np.arange(-8.0, 1013.0, 4.0)
    r = position_at(t)
    radius, greenwich = np.linalg.norm(r, axis=1), GREENWICH_0 + EARTH_RATE * t
    colatitude, right_ascension = np.arccos(r[:, 2] / radius), np.arctan2(r[:, 1], r[:, 0])
    spherical = ppigrf.igrf_gc(radius / 1e3, np.degrees(colatitude), np.degrees(right_ascension - greenwich), date)
    up, south, east = (1e-9 * x[0][:, None] for x in spherical)
    st, ct, sp, cp = np.sin(colatitude), np.cos(colatitude), np.sin(right_ascension), np.cos(right_ascension)
    axes = np.array([[st * cp, st * sp, ct], [ct * cp, ct * sp, -st], [-sp, cp, 0 * sp]]).transpose(0, 2, 1)
    spline = CubicSpline(t, up * axes[0] + south * axes[1] + east * axes[2])

    cases, times = Cases(14, [0.012]), np.linspace(100.0, 1000.0, 10)
    attitudes, rates = cases.truth(1000.0, times / 1000.0, spline)
    grid = jax.tree.map(jnp.asarray, StepGrid.through(times, start=0.0, max_step=2.0))
    table = eqx.filter_jit(Surroundings(ORBIT, igrf_field(year), GREENWICH_0))(grid.node_times)
    move = eqx.filter_jit(simulate_on_grid)
    motion = move(craft_with(cases.inertia[0], cases.magnet[0]), state(cases.q[0], cases.w[0]), table, grid)
    # The step's own error, 6e-8 rad as measured.
    assert angle(motion.quaternion, attitudes[0]) < 1e-7
    np.testing.assert_allclose(motion.angular_velocity, rates[0], rtol=0, atol=1e-9)
    # The torques matter: without them the attitude would be elsewhere by radians.
    assert np.max(np.abs(rates[0] - cases.w[0])) > 5e-3
