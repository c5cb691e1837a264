"""The torques that follow from a satellite's parts: which, in which order, and a motion by each set of them."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.dynamics import AttitudeState, derivative, rigid_body
from jaxsat.environment import OrbitTable
from jaxsat.integrators import AdamsGrid, StepGrid
from jaxsat.simulate import simulate, simulate_many
from jaxsat.spacecraft import HysteresisRods, MagneticRods, Spacecraft, box_facets, in_axes
from jaxsat.torques import (
    AerodynamicTorque,
    GravityGradient,
    HysteresisRodsTorque,
    LinearRodsTorque,
    PermanentMagnet,
    ResidualTorque,
    SolarPressureTorque,
    torques_of,
)

INERTIA = jnp.asarray([[0.0514, 0.0014, -0.0022], [0.0014, 0.0549, 0.0011], [-0.0022, 0.0011, 0.0578]])
BARE = Spacecraft(INERTIA)
LEAK = ResidualTorque(np.array([1e-7, -2e-7, 3e-7]))
FULL = Spacecraft(
    INERTIA,
    magnet=jnp.asarray([0.3, 0.004, -0.01]),
    rods=MagneticRods(jnp.asarray([0.035, 0.025]), jnp.eye(3)[1:], jnp.asarray(3.0e-5)),
    hysteresis_rods=HysteresisRods(
        np.eye(3)[:1], np.array([3e-6]), np.array([12.0]), np.array([0.004]), np.array([0.025])
    ),
    facets=box_facets((0.1, 0.2, 0.3), center_of_mass=(0.01, 0.0, 0.02)),
    parts=(LEAK,),
)
STATE = AttitudeState(jnp.asarray([0.5, -0.5, 0.7, 0.1]), jnp.asarray([0.021, -0.013, 0.017]), jnp.asarray([0.3]))
POINT = OrbitTable(
    position_eci=jnp.asarray([-3.5e6, 6.1e6, 2.9e6]),
    b_field_eci=jnp.asarray([1.2e-5, -2.5e-5, 0.7e-5]),
    b_rate_eci=jnp.asarray([1e-8, 2e-8, -1e-8]),
)
AIR_AND_SUN = {
    "air_velocity_eci": jnp.asarray([7e3, 1e3, 0.0]),
    "air_density": jnp.asarray(1e-12),
    "sun_eci": jnp.asarray([0.0, 0.6, 0.8]),
    "solar_pressure": jnp.asarray(4.4e-6),
}
WINDY = dataclasses.replace(POINT, **AIR_AND_SUN)

slope = eqx.filter_jit(derivative)


def kinds(craft, around=None):
    return [type(torque) for torque in torques_of(craft, around)]


def test_what_is_there_has_its_torque():
    assert kinds(BARE) == [GravityGradient]
    assert kinds(Spacecraft(INERTIA, jnp.ones(3))) == [GravityGradient, PermanentMagnet]
    inner = [GravityGradient, PermanentMagnet, LinearRodsTorque, HysteresisRodsTorque]
    assert kinds(FULL) == kinds(FULL, POINT) == [*inner, ResidualTorque]
    assert kinds(FULL, WINDY) == [*inner, AerodynamicTorque, SolarPressureTorque, ResidualTorque]
    assert kinds(BARE, WINDY) == [GravityGradient]


@pytest.mark.slow
@pytest.mark.parametrize("point", [POINT, WINDY], ids=["field", "air and Sun too"])
def test_by_default_these_act(point):
    """A hysteresis satellite's default: bit for bit what the same torques give when they are named, its lag too."""
    found = slope(STATE, point, rigid_body(FULL))
    expected = slope(STATE, point, rigid_body(FULL, torques_of(FULL, point)))
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(expected), strict=True):
        np.testing.assert_array_equal(one, other)
    assert found.rod_lag is not None and float(found.rod_lag[0]) != 0.0
    without = slope(STATE, point, rigid_body(FULL, torques_of(FULL, point)[:3]))
    assert np.abs(found.angular_velocity - without.angular_velocity).max() > 1e-7


def test_what_the_default_needs_is_named():
    state = AttitudeState(STATE.quaternion, STATE.angular_velocity)
    with pytest.raises(ValueError, match=r"HysteresisRodsTorque needs AttitudeState\.rod_lag, .*lag_from_induction"):
        derivative(state, POINT, rigid_body(FULL))
    for torque, part in ((PermanentMagnet(), "magnet"), (LinearRodsTorque(), "rods")):
        with pytest.raises(ValueError, match=rf"needs Spacecraft\.{part}, which is None"):
            derivative(state, POINT, rigid_body(BARE, (torque,)))
    with pytest.raises(ValueError, match=r"Spacecraft\.parts: expected AbstractTorques, got Identity"):
        torques_of(Spacecraft(INERTIA, parts=(eqx.nn.Identity(),)))
    with pytest.raises(ValueError, match=r"Spacecraft\.parts cannot be described in other axes"):
        in_axes(FULL, np.eye(3))


def test_absent_parts_are_no_leaves_and_no_work():
    """The compiled program of a bare satellite is that of one with the gravity gradient alone named."""
    assert len(jax.tree.leaves(BARE)) == 1
    state = AttitudeState(STATE.quaternion, STATE.angular_velocity)
    by_default, named = (
        eqx.filter_jit(derivative).lower(state, POINT, rigid_body(BARE, torques)).as_text()
        for torques in (None, (GravityGradient(),))
    )
    assert by_default == named


def test_other_axes_with_and_without_parts():
    dcm = jnp.asarray([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    found = in_axes(BARE, dcm)
    np.testing.assert_array_equal(found.inertia, dcm @ INERTIA @ dcm.T)
    assert len(jax.tree.leaves(found)) == 1
    whole = eqx.tree_at(lambda craft: craft.parts, FULL, ())
    found = in_axes(whole, dcm)
    np.testing.assert_array_equal(found.magnet, dcm @ whole.magnet)
    assert found.facets is not None and whole.facets is not None
    np.testing.assert_array_equal(found.facets.centers, whole.facets.centers @ dcm.T)


def far_away(times):
    """No field and no gradient: whatever turns the satellite is its own."""
    far = jnp.broadcast_to(jnp.asarray([1e12, 0.0, 0.0]), (len(times), 3))
    return OrbitTable(far, jnp.zeros_like(far))


def in_the_wind(times):
    along = jnp.broadcast_to(AIR_AND_SUN["air_velocity_eci"], (len(times), 3))
    density = jnp.full(len(times), 1e-12)
    return eqx.tree_at(
        lambda table: (table.air_velocity_eci, table.air_density),
        far_away(times),
        (along, density),
        is_leaf=lambda leaf: leaf is None,
    )


TIMES = np.array([40.0, 95.0, 150.0])


@pytest.mark.slow
def test_a_part_of_ones_own_moves_the_satellite():
    """A leak along a principal axis from rest: the turn is a t^2 / 2, alone and in a fleet of different leaks."""
    principal = jnp.diag(jnp.asarray([0.05, 0.055, 0.06]))
    rest = AttitudeState(jnp.asarray([1.0, 0.0, 0.0, 0.0]), jnp.zeros(3))
    leaks = np.array([[0.0, 0.0, 3e-6], [0.0, 0.0, -1e-6]])
    expected = 0.5 * leaks[:, 2:] / 0.06 * TIMES**2

    craft = Spacecraft(principal, parts=(ResidualTorque(leaks[0]),))
    motion = simulate(craft, rest, far_away, TIMES, tolerance=1e-6)
    assert motion.error is not None
    turn = 2.0 * np.arctan2(motion.quaternion[:, 3], motion.quaternion[:, 0])
    np.testing.assert_allclose(turn, expected[0], atol=motion.error + 1e-12)

    fleet = jax.vmap(lambda leak: Spacecraft(principal, parts=(ResidualTorque(leak),)))(jnp.asarray(leaks))
    both = jax.tree.map(lambda leaf: jnp.stack([leaf] * 2), rest)
    motion = simulate_many(fleet, both, far_away, TIMES, max_step=1.0)
    turn = 2.0 * np.arctan2(motion.quaternion[..., 3], motion.quaternion[..., 0])
    np.testing.assert_allclose(turn, expected, atol=1e-9)


@pytest.mark.slow
def test_air_acts_on_a_surface_where_there_is_some():
    """And what has kinks is not left to the method for smooth motions."""
    craft = Spacecraft(INERTIA, facets=FULL.facets)
    rest = AttitudeState(jnp.asarray([1.0, 0.0, 0.0, 0.0]), jnp.zeros(3))
    still, moved = (simulate(craft, rest, place, TIMES, tolerance=1e-4) for place in (far_away, in_the_wind))
    assert isinstance(still.grid, AdamsGrid) and isinstance(moved.grid, StepGrid)
    np.testing.assert_allclose(still.quaternion[-1], rest.quaternion, atol=1e-15)
    assert 2.0 * np.linalg.norm(moved.quaternion[-1, 1:]) > 1e-3
