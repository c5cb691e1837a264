"""The law by what it decides, one control period at a time."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.control.sun_pointing.law import (
    DAMPING,
    HOLD,
    SEARCH,
    SLEW,
    Guidance,
    SunPointingLaw,
    decide,
    wanted_torque,
)
from jaxsat.control.sun_pointing.vehicle import BODY_FROM_INSTRUMENT, INERTIA_KG_M2

LAW = SunPointingLaw()
MOUNTING, INERTIA = jnp.asarray(BODY_FROM_INSTRUMENT), jnp.asarray(INERTIA_KG_M2)
AXIS, BESIDE = jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 0.0, 1.0])
STILL, SPINNING = jnp.zeros(3), jnp.array([0.0, 0.03, 0.0])
one_period, torque_of = jax.jit(decide), jax.jit(wanted_torque)


def decided(mode, *, sun=AXIS, known=True, rate=STILL, time_in_mode=0.0, now=500.0, law=LAW):
    memory = Guidance(jnp.asarray(mode), jnp.asarray(time_in_mode), jnp.asarray(jnp.inf))
    guidance, command = one_period(law, memory, sun, jnp.asarray(known), rate, MOUNTING, jnp.asarray(now), 1.0)
    return guidance, np.asarray(command)


@pytest.mark.parametrize(
    ("mode", "given", "after"),
    [
        (DAMPING, {"rate": SPINNING}, DAMPING),
        (DAMPING, {}, SLEW),
        (DAMPING, {"known": False}, SEARCH),
        (SEARCH, {"known": False}, SEARCH),
        (SEARCH, {"sun": BESIDE}, SLEW),
        (SLEW, {"sun": BESIDE}, SLEW),
        (SLEW, {"rate": SPINNING}, SLEW),
        (SLEW, {}, HOLD),
        (SLEW, {"known": False}, SEARCH),
        (HOLD, {}, HOLD),
        (HOLD, {"sun": BESIDE}, SLEW),
        (HOLD, {"known": False}, SEARCH),
    ],
)
def test_modes_follow_one_another(mode, given, after):
    guidance, _ = decided(mode, **given)
    assert int(guidance.mode) == after
    assert float(guidance.time_in_mode) == (1.0 if after == mode else 0.0)


def test_the_sun_is_stabilised_once_it_was_held_long_enough():
    short, _ = decided(HOLD, time_in_mode=50.0)
    long, _ = decided(HOLD, time_in_mode=float(LAW.hold_time) - 1.0)
    assert not np.isfinite(short.settled_at) and float(long.settled_at) == 500.0
    # The first time counts.
    again = Guidance(jnp.asarray(HOLD), jnp.asarray(300.0), jnp.asarray(200.0))
    guidance, _ = one_period(LAW, again, AXIS, jnp.asarray(True), STILL, MOUNTING, jnp.asarray(500.0), 1.0)
    assert float(guidance.settled_at) == 200.0


def test_a_slew_turns_the_sensors_axis_toward_the_sun():
    for sun in (BESIDE, -BESIDE, jnp.array([0.6, 0.8, 0.0]), jnp.array([-0.8, 0.0, 0.6])):
        _, command = decided(SLEW, sun=sun)
        rate = MOUNTING.T @ command
        # The Sun moves against the instrument's turn.
        motion = np.cross(np.asarray(sun), rate)
        assert motion[0] > 0.0
        assert np.linalg.norm(command) == pytest.approx(float(LAW.slew_rate))
        assert abs(np.dot(rate, np.asarray(sun))) < 1e-12


def test_the_sun_is_held_at_an_angle_from_the_axis():
    law = SunPointingLaw(sun_angle=np.radians(20.0))
    _, command = decided(SLEW, sun=law.target(), law=law)
    np.testing.assert_allclose(command, 0.0, atol=1e-15)
    assert np.degrees(np.arccos(float(law.target()[0]))) == pytest.approx(20.0)


def test_the_search_goes_about_one_axis_and_then_another():
    turn = float(LAW.search_turn / LAW.search_rate)
    first = MOUNTING.T @ decided(SEARCH, known=False, time_in_mode=10.0)[1]
    second = MOUNTING.T @ decided(SEARCH, known=False, time_in_mode=turn + 10.0)[1]
    np.testing.assert_allclose(first, [0.0, float(LAW.search_rate), 0.0], atol=1e-15)
    np.testing.assert_allclose(second, [0.0, 0.0, float(LAW.search_rate)], atol=1e-15)


def test_torque_works_against_the_error_of_the_rate_and_leaves_small_ones_alone():
    guidance, command = decided(DAMPING, rate=SPINNING)
    torque, band = torque_of(LAW, guidance, jnp.asarray(command), SPINNING, INERTIA)
    assert float(torque @ SPINNING) < 0.0 and not np.any(band)
    # Without an error of the rate the torque only carries the spin: w x J w.
    torque, _ = torque_of(LAW, guidance, SPINNING, SPINNING, INERTIA)
    np.testing.assert_allclose(torque, np.cross(SPINNING, INERTIA @ SPINNING), rtol=1e-12)
    holding, _ = decided(HOLD)
    _, band = torque_of(LAW, holding, STILL, STILL, INERTIA)
    expected = float(LAW.rate_gain * LAW.rate_dead_band) * np.diag(INERTIA_KG_M2)
    np.testing.assert_allclose(band, expected, rtol=1e-12)
