"""Panels that turn on the satellite of the emergency mode: against SciPy's two-part body and closed forms."""

import dataclasses
import math

import jax
import jax.flatten_util
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.control.emergency_mode.loop import moved
from jaxsat.control.emergency_mode.orbit import Leg, SunFollowing, leg, wanted_attitude
from jaxsat.control.emergency_mode.rotating_panels import (
    PARKED,
    PanelMotion,
    PanelSlew,
    facing_sun,
    inertia_at,
    panel_momentum,
    panel_motion,
    panel_torque,
)
from jaxsat.control.emergency_mode.vehicle import nominal_vehicle, outer_surface, turned_panels
from jaxsat.environment import igrf_dipole

PANEL = np.array([[300.0, 20.0, -30.0], [20.0, 350.0, 10.0], [-30.0, 10.0, 120.0]])
"""Heavier than the satellite's, and of no symmetry, so that every term counts."""
VEHICLE = nominal_vehicle()
J = np.asarray(VEHICLE.inertia)
E = np.array([0.0, 0.0, 1.0])
PERIODS = 200


@jax.jit
def drift(vehicle, around, q, w):
    """Attitudes and rates at the ends of control periods, without control."""
    ends = slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2)
    nodes = tuple(jax.tree.map(lambda leaf, part=part: leaf[part], around) for part in ends)

    def step(state, nodes):
        state = moved(vehicle, nodes, state[0], state[1], jnp.zeros(3))
        return state, state

    return jax.lax.scan(step, (q, w), nodes)[1]


motions = jax.jit(jax.vmap(panel_motion, in_axes=(None, 0)))


def empty(angle):
    """Surroundings without any torque."""
    t = 8.0 * np.arange(2 * PERIODS + 1)
    zero, axis = np.zeros((len(t), 3)), np.tile([0.0, 0.0, 1.0], (len(t), 1))
    position, normal, none, zero, rate = (jnp.asarray(x) for x in (1e13 * axis[:, ::-1], axis, 0.0 * t, zero, 0.0 * t))
    panels = motions(angle, jnp.asarray(t))
    return Leg(position, normal, rate, zero, normal, none, panels=panels)


def panels_at(gamma):
    turn = Rotation.from_rotvec(gamma * E).as_matrix()
    return 2.0 * turn @ PANEL @ turn.T


def core():
    return J - panels_at(-np.pi / 2)


@pytest.mark.slow
def test_momentum_of_body_and_panels_is_kept_as_by_scipy():
    """Turning about all axes while the panels go 130 deg, and on the way, against DOP853 of two bodies."""
    vehicle = dataclasses.replace(VEHICLE, panel_inertia=jnp.asarray(PANEL))
    # The slew begins with a step: within one its jerk would jump.
    begin, end, duration = 0.1, 0.1 + math.radians(130.0), 4000.0
    slew = PanelSlew(begin, end, 320.0, duration)
    q0, w0 = np.array([0.5, -0.5, 0.1, 0.7]), np.array([1e-3, -8e-4, 5e-4])
    found, rates = drift(vehicle, empty(slew), jnp.asarray(q0), jnp.asarray(w0))
    found, rate_found = np.asarray(found[-1]), np.asarray(rates[-1])

    def panel(t):
        s = min(max((t - 320.0) / duration, 0.0), 1.0)
        rate = (end - begin) / duration * 30.0 * s**2 * (1.0 - s) ** 2
        return begin + (end - begin) * (10 * s**3 - 15 * s**4 + 6 * s**5), rate

    def momentum(t, w):
        gamma, rate = panel(t)
        return core() @ w + panels_at(gamma) @ (w + rate * E)

    h = Rotation.from_quat([*q0[1:], q0[0]]).apply(momentum(0.0, w0))

    def rate_of(t, q):
        gamma, rate = panel(t)
        body = Rotation.from_quat([*q[1:], q[0]]).inv().apply(h)
        return np.linalg.solve(core() + panels_at(gamma), body - panels_at(gamma) @ (rate * E))

    def slope(t, q):
        w = rate_of(t, q)
        return 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])

    stop = 16.0 * PERIODS
    q1 = solve_ivp(slope, (0.0, stop), q0, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    w1 = rate_of(stop, q1)
    assert panel(stop)[1] > 2e-4 and np.abs(w1 - w0).max() > 1e-4
    np.testing.assert_allclose(found, q1 / np.linalg.norm(q1), atol=1e-8)
    np.testing.assert_allclose(rate_found, w1, atol=1e-12)
    h1 = Rotation.from_quat([*found[1:], found[0]]).apply(momentum(stop, rate_found))
    np.testing.assert_allclose(h1, h, atol=1e-9 * float(np.linalg.norm(h)))


@pytest.mark.slow
def test_panels_turned_one_way_turn_the_body_the_other():
    """From rest about z: by their inertia over that of all, and it stands still when they do."""
    around = empty(PanelSlew(-math.pi / 2, math.pi / 2, 0.0, 1600.0))
    q, w = drift(VEHICLE, around, jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.zeros(3))
    moment = 2.0 * float(VEHICLE.panel_inertia[2, 2])
    turned = 2.0 * np.arctan2(np.asarray(q)[:, 3], np.asarray(q)[:, 0])
    assert (np.diff(turned)[2:95] < 0.0).all() and moment == pytest.approx(90.0)
    np.testing.assert_allclose(turned[-1], -math.pi * moment / J[2, 2], rtol=3e-8)
    assert np.abs(np.asarray(w)[100:]).max() < 1e-15


def test_inertia_is_that_given_with_the_panels_parked():
    panel = jnp.asarray(PANEL)
    np.testing.assert_allclose(inertia_at(VEHICLE.inertia, panel, jnp.asarray(PARKED)), J, atol=1e-10)
    for gamma in (-2.0, 0.0, 0.4):
        expected = core() + panels_at(gamma)
        np.testing.assert_allclose(inertia_at(VEHICLE.inertia, panel, jnp.asarray(gamma)), expected, atol=1e-9)
    # At zero a plate 5 m long and 3 m wide, normal along y: 60 (25 - 34) / 6 kg m^2 less about x than parked.
    found = inertia_at(VEHICLE.inertia, VEHICLE.panel_inertia, jnp.asarray(0.0))
    np.testing.assert_allclose(found - J, np.diag([-90.0, 90.0, 0.0]), atol=1e-9)


def test_slopes_against_differences():
    """Of the torque by everything, and of a slew where it begins and ends."""
    given = (jnp.asarray(PANEL), PanelMotion(*map(jnp.asarray, (0.3, 0.02, 1e-3))), jnp.array([0.01, -0.02, 0.03]))
    flat, build = jax.flatten_util.ravel_pytree(given)
    torque = jax.jit(lambda x: panel_torque(*build(x)))
    slopes = np.asarray(jax.jit(jax.jacfwd(lambda x: panel_torque(*build(x))))(flat))
    for k in range(len(flat)):
        step = 1e-4 * np.eye(len(flat))[k]
        found = (np.asarray(torque(flat + step)) - np.asarray(torque(flat - step))) / 2e-4
        np.testing.assert_allclose(slopes[:, k], found, rtol=1e-6, atol=1e-7)
    slew = PanelSlew(0.2, -1.0, 100.0, 50.0)
    motion = motions(slew, jnp.array([0.0, 100.0, 125.0, 150.0, 1e4]))
    np.testing.assert_allclose(motion.angle, [0.2, 0.2, -0.4, -1.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(motion.rate, [0.0, 0.0, -1.2 / 50.0 * 1.875, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(motion.acceleration, 0.0, atol=1e-12)


def test_momentum_and_torque_of_panels_agree():
    """Mp for a body that does not turn is the loss of h, by differences."""
    slew = PanelSlew(0.2, -1.0, 0.0, 50.0)
    panel = jnp.asarray(PANEL)
    h = jax.jit(lambda t: panel_momentum(panel, panel_motion(slew, t)))
    found = jax.jit(lambda t: panel_torque(panel, panel_motion(slew, t), jnp.zeros(3)))(20.0)
    expected = -(np.asarray(h(20.001)) - np.asarray(h(19.999))) / 0.002
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_facets_turn_with_the_panels():
    parked = outer_surface()
    same, zero = turned_panels(parked, jnp.asarray(PARKED)), turned_panels(parked, jnp.asarray(0.0))
    np.testing.assert_allclose(same.normals, parked.normals, atol=1e-15)
    np.testing.assert_allclose(zero.normals[6:], [[0, 1, 0], [0, -1, 0]] * 2, atol=1e-15)
    np.testing.assert_allclose(zero.normals[:6], parked.normals[:6])
    np.testing.assert_allclose(zero.centers, parked.centers, atol=1e-15)


@pytest.mark.slow
def test_panels_that_follow_the_sun(flight):
    """Their normal sees it as well as any normal across the hinge can."""
    flight = dataclasses.replace(flight, field=igrf_dipole(2018.8))
    around = leg(flight, 0, PERIODS, panels=SunFollowing(flight))
    panels = around.panels
    assert panels is not None
    wanted = jax.jit(jax.vmap(wanted_attitude))(around.position_eci, around.normal_eci)
    sun = np.einsum("tij,ti->tj", np.asarray(wanted), np.asarray(around.sun_eci))
    normal = np.stack([-np.sin(panels.angle), np.cos(panels.angle), np.zeros(len(sun))], axis=1)
    np.testing.assert_allclose(np.sum(normal * sun, axis=1), np.hypot(sun[:, 0], sun[:, 1]), atol=1e-12)
    # To both sides of body x, by the cone's half-angle.
    away = np.degrees(panels.angle) + 90.0
    assert np.abs(away).max() == pytest.approx(60.1, abs=0.5)
    # Differences over 16 s err by a sixth of 64 s^2 times the third derivative, some (2e-3 rad/s)^3.
    np.testing.assert_allclose(np.gradient(panels.angle, 8.0)[1:-1], panels.rate[1:-1], atol=3e-7)
    np.testing.assert_allclose(np.gradient(panels.rate, 8.0)[1:-1], panels.acceleration[1:-1], atol=1e-9)
    # Panels said to stand at -90 deg are those that nothing is said of.
    zero = 0.0 * panels.angle
    q, w = jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.array([1e-3, 0.0, 1e-4])
    both = [
        drift(VEHICLE, dataclasses.replace(around, panels=given), q, w)[0]
        for given in (PanelMotion(zero + PARKED, zero, zero), None)
    ]
    np.testing.assert_allclose(both[0], both[1], atol=1e-12)


def test_the_sun_in_the_plane_of_the_panels_turn():
    for gamma in (-2.5, -0.1, 1.0):
        normal = Rotation.from_rotvec(gamma * E).apply([0.0, 1.0, 0.0])
        assert float(facing_sun(jnp.asarray(normal + 0.7 * E))) == pytest.approx(gamma, abs=1e-14)
