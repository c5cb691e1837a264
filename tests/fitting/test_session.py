"""From a session to the fit's SI input, against the truth beside the sessions."""

import dataclasses
import json
import math

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.session import prepare_session
from fitting.surroundings import surroundings
from jaxsat.bundled import BUNDLED
from jaxsat.errors import InputError
from jaxsat.given import Earth, Given, Orbit, Sun
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_session, read_telemetry

SESSION = BUNDLED.with_name("a-nominal-exact.RAW_SUN")


@pytest.fixture(scope="module")
def truth():
    return json.loads(SESSION.with_suffix(".truth.json").read_text())


@pytest.fixture(scope="module")
def prepared():
    return prepare_session(read_session(SESSION))


def test_samples_and_surroundings_are_the_true_ones(prepared, truth):
    session, around = prepared.session, prepared.around
    np.testing.assert_allclose(session.t_s, truth["t"], atol=1e-9)
    # The file has whole milliamperes.
    np.testing.assert_allclose(session.currents_mA, truth["currents_clean"], atol=0.51)
    sun = prepared.sun_eci(session.t_s)
    np.testing.assert_allclose(np.linalg.norm(sun, axis=1), 1.0, atol=1e-12)
    # 0.01 deg, and the Sun's 0.05 deg in 4500 s where the truth holds it still.
    np.testing.assert_allclose(sun, np.broadcast_to(truth["sun"], sun.shape), atol=1.2e-3)
    off = float(around.greenwich_angle) - truth["greenwich0"]
    assert math.remainder(off, 2 * math.pi) == pytest.approx(0.0, abs=1.7e-4)
    assert float(around.orbit.semi_major_axis) == pytest.approx(truth["cfg"]["elements"]["a"], abs=5.0)
    assert float(around.earth_radius) == 6371200.0
    assert float(around.rotation_rate) == pytest.approx(7.292115e-5, rel=1e-6)


def test_a_table_of_the_session_has_the_same_surroundings(prepared):
    satellite = read_satellite()
    given = Given(sun=Sun(direction_eci=(0.0, 0.6, 0.8)), earth=Earth(greenwich_angle_deg=20.0, radius_km=6400.0))
    session = read_telemetry(SESSION, satellite)
    around, fit = surroundings(satellite, session)
    assert fit is not None
    np.testing.assert_allclose(np.asarray(fit.orbit.semi_major_axis), prepared.orbit_fit.orbit.semi_major_axis)
    assert float(around.greenwich_angle) == prepared.greenwich_angle and around.sharp
    t = np.array([0.0, 4000.0])
    np.testing.assert_array_equal(around.sun_eci(session.epoch, t), prepared.sun_eci(t))
    around, _ = surroundings(satellite, session, given)
    np.testing.assert_allclose(around.sun_eci(session.epoch, t), [[0.0, 0.6, 0.8]] * 2)
    assert math.degrees(float(around.greenwich_angle)) == pytest.approx(20.0)
    assert float(around.earth_radius) == 6400000.0


def test_arc_takes_its_ends(prepared):
    t = prepared.session.t_s[prepared.within((64.0, 640.0))]
    assert t[0] == 64.0 and t[-1] == 640.0 and len(t) == 10
    with pytest.raises(InputError, match=r"RAW_SUN: arc: no sample between 10 and 20 s; .* from 0 to 4480 s"):
        prepared.within((10.0, 20.0))


def test_what_is_given_takes_the_place_of_what_is_found(prepared):
    """Table 1 of Penkov et al. 2009: elements, Greenwich angle at perigee and Sun as published."""
    orbit = Orbit(
        inclination_deg=95.438873,
        raan_deg=64.81879,
        argument_of_perigee_deg=16.675906,
        eccentricity=0.072661,
        semi_major_axis_km=7630.026457,
        time_of_perigee_s=3230.533197,
    )
    earth = Earth(greenwich_angle_at_perigee_deg=204.78, radius_km=6378.0)
    sun = Sun(direction_eci=(0.47176670, -0.80932067, -0.34990890))
    given = prepare_session(prepared.session, Given(orbit=orbit, earth=earth, sun=sun))
    sun_eci = given.sun_eci(given.session.t_s)
    position, _ = given.orbit_fit.orbit(jnp.asarray(3230.533197))
    # The exact session flew these elements, to the digits published.
    assert given.orbit_fit.rms_after_m < 1.0 and "given by the configuration" in given.orbit_fit.message
    # At perigee: a (1 - e) from the centre.
    assert np.linalg.norm(position) == pytest.approx(7630026.457 * (1 - 0.072661), rel=1e-9)
    assert math.degrees(given.greenwich_angle) == pytest.approx(204.78 - 3230.533197 * 360.98564737 / 86400, abs=1e-4)
    assert sun_eci.shape == (71, 3) and np.ptp(sun_eci, axis=0).max() == 0.0
    np.testing.assert_allclose(np.linalg.norm(sun_eci, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(sun_eci[0], [0.47176670, -0.80932067, -0.34990890], atol=1e-7)
    assert float(given.around.earth_radius) == 6378000.0


def test_a_time_zero_that_is_given_moves_all_times_of_a_table():
    satellite = read_satellite()
    session = read_telemetry(SESSION, satellite)
    moved = session.with_time_zero(100.0)
    assert moved.epoch.seconds_since(session.epoch) == pytest.approx(100.0, abs=1e-6)
    for name, channel in session.channels.items():
        np.testing.assert_allclose(moved.channels[name].t_s, channel.t_s - 100.0)
    assert session.positions is not None and moved.positions is not None
    np.testing.assert_allclose(moved.positions[0], session.positions[0] - 100.0)
    old, new = (surroundings(satellite, each)[0] for each in (session, moved))
    np.testing.assert_allclose(new.orbit(jnp.asarray(0.0))[0], old.orbit(jnp.asarray(100.0))[0], rtol=1e-6)


def test_elements_that_are_given_need_positions_to_stand_for():
    satellite = read_satellite()
    session = dataclasses.replace(read_telemetry(SESSION, satellite), positions=None)
    orbit = Orbit(
        inclination_deg=95.0,
        raan_deg=64.0,
        argument_of_perigee_deg=16.0,
        eccentricity=0.07,
        semi_major_axis_km=7630.0,
        time_of_perigee_s=0.0,
    )
    with pytest.raises(InputError, match="take the place of positions"):
        surroundings(satellite, session, Given(orbit=orbit))
