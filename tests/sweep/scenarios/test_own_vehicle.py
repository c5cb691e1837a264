"""Vehicle, gains, orbit and date of the bundled scenarios by options: the defaults are the studies', others arrive."""

import math

import numpy as np
import pytest

from jaxsat.control.earth_search.law import EarthSearchLaw
from jaxsat.control.emergency_mode import orbit, vehicle
from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.sun_pointing import vehicle as sun_vehicle
from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.errors import InputError
from jaxsat.sweep import Source
from jaxsat.sweep.more_options import date_of, inertia_of, numbers_of
from jaxsat.sweep.scenarios import earth_search, emergency_mode, gravity_gradient, sun_pointing


def test_defaults_are_those_of_the_studies():
    """To the last digit, so that sweeps are what they were."""
    sun, law = sun_pointing.make.filled({}), SunPointingLaw()
    np.testing.assert_array_equal(inertia_of(sun, "moments_kg_m2", "products_kg_m2"), sun_vehicle.INERTIA_KG_M2)
    assert numbers_of(sun, "torque_N_m", 3) == sun_vehicle.TORQUE_N_M
    single = (sun_vehicle.LEVER_M, sun_vehicle.MIN_PULSE_S, sun_vehicle.EXHAUST_SPEED_M_S, law.hold_time)
    assert tuple(float(sun[name]) for name in ("lever_m", "min_pulse_s", "exhaust_m_s", "hold_s")) == single
    assert (float(sun["attitude_gain"]), float(sun["rate_gain"])) == (law.attitude_gain, law.rate_gain)
    for name, value in (("slew_rate_deg_s", law.slew_rate), ("search_rate_deg_s", law.search_rate)):
        assert math.radians(float(sun[name])) == value

    own, gains = emergency_mode.make.filled({}), EmergencyLaw()
    assert date_of(own, "start") == vehicle.START_UTC
    np.testing.assert_array_equal(inertia_of(own, "moments_kg_m2"), vehicle.INERTIA_KG_M2)
    for name in ("attitude_gain", "rate_gain", "fine_gain", "fine_lead", "fine_pole"):
        assert float(own[name]) == getattr(gains, name)
    assert math.radians(float(own["fine_below_deg"])) == gains.fine_below
    numbers = (vehicle.HEIGHT_KM, vehicle.INCLINATION_DEG, vehicle.NODE_DEG, gains.max_dipole)
    assert tuple(float(own[k]) for k in ("height_km", "inclination_deg", "node_deg", "max_dipole_A_m2")) == numbers
    noises = (vehicle.ATTITUDE_SIGMA_DEG, vehicle.RATE_SIGMA_DEG_S, vehicle.FIELD_SIGMA_NT)
    assert tuple(float(own[k]) for k in ("attitude_noise_deg", "rate_noise_deg_s", "field_noise_nT")) == noises

    assert float(earth_search.make.filled({})["track_gain"]) == EarthSearchLaw().track_gain
    tall = gravity_gradient.make.filled({})
    assert numbers_of(tall, "moments_kg_m2", 3) == gravity_gradient.MOMENTS
    assert gravity_gradient.EARTH + 1e3 * float(tall["altitude_km"]) == gravity_gradient.RADIUS


@pytest.mark.parametrize(
    ("scenario", "options", "expected"),
    [
        (emergency_mode, {"start": "2018-13-01"}, "start: expected a date as 2018-10-14, found '2018-13-01'"),
        (emergency_mode, {"start": "14.10.2018"}, "start: expected a date as 2018-10-14"),
        (emergency_mode, {"start": "2050-01-01"}, "start: expected a year from 1900 to 2029"),
        (emergency_mode, {"height_km": "100"}, "height_km: expected a number from 200 to 2000"),
        (emergency_mode, {"moments_kg_m2": "1,1,3"}, "moments_kg_m2: no body has these principal moments"),
        (gravity_gradient, {"moments_kg_m2": "12,12.5"}, "moments_kg_m2: expected 3 numbers apart by commas"),
        (gravity_gradient, {"moments_kg_m2": "12,x,0.6"}, "moments_kg_m2: expected a number from 0"),
        (gravity_gradient, {"altitude_km": "-1"}, "altitude_km: expected a number from 150"),
        (sun_pointing, {"products_kg_m2": "900,0,0"}, "moments_kg_m2: inertia tensor is not positive definite"),
        (sun_pointing, {"min_pulse_s": "2"}, "min_pulse_s: expected a number from 0 to 1"),
        (earth_search, {"lag_s": "-1"}, "lag_s: expected a number from 0 to 1000"),
    ],
)
def test_what_no_vehicle_is_like_is_one_line(scenario, options, expected):
    with pytest.raises(InputError) as caught:
        scenario.make(options)
    assert expected in str(caught.value) and "\n" not in str(caught.value)


def test_another_vehicle_is_another_sweep_and_arrives(monkeypatch):
    sources = [
        Source.of("jaxsat.sweep.scenarios.emergency_mode:make", given) for given in ({}, {"start": "2020-06-13"})
    ]
    assert dict(sources[0].options) != dict(sources[1].options)
    asked = {}

    def fly(days, **settings):
        asked.update(settings, days=days)
        raise InterruptedError

    monkeypatch.setattr(orbit, "fly", fly)
    made = emergency_mode.make({"start": "2020-06-13", "height_km": "1500", "node_deg": "10", "orbits": "1"})
    assert made.draw is not None
    with pytest.raises(InterruptedError):
        made.draw(0, np.arange(2))
    assert (asked["start_utc"], asked["height_km"], asked["inclination_deg"], asked["node_deg"]) == (
        (2020, 6, 13),
        1500.0,
        98.2695,
        10.0,
    )
    # Long enough for an orbit of 6957 s (Kepler's third law).
    period = 2.0 * math.pi * math.sqrt(7878.1363e3**3 / 3.986004415e14)
    assert asked["days"] * 86400.0 > 1.2 * period


def test_a_vehicle_of_ones_own_is_the_one_that_flies():
    given = {"moments_kg_m2": "3,4,5", "products_kg_m2": "0,0.1,0", "torque_N_m": "0.1,0.2,0.3", "min_pulse_s": "0.1"}
    made = sun_pointing.make(given)
    assert made.draw is not None
    flown = made.draw(0, np.arange(4)).vehicle
    np.testing.assert_allclose(flown.inertia, [[3.0, 0.0, 0.1], [0.0, 4.0, 0.0], [0.1, 0.0, 5.0]])
    np.testing.assert_allclose(flown.inertia @ flown.inverse_inertia, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(flown.assumed_inertia, flown.inertia)
    np.testing.assert_allclose(flown.thrusters.torque, [0.1, 0.2, 0.3])
