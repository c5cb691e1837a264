"""From a session to the fit's SI input, against the truth beside the sessions."""

import json
import math
from typing import get_args

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters.names import TILTS
from fitting.parameters.nominal import nominal_model
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.chunk import EVALUATIONS
from fitting.solvers.refine import LIKELIHOODS
from jaxsat.bundled import BUNDLED
from jaxsat.errors import InputError
from jaxsat.given import Earth, Given, Orbit, Sun
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

SESSION = BUNDLED.with_name("a-nominal-exact.RAW_SUN")


@pytest.fixture(scope="module")
def truth():
    return json.loads(SESSION.with_suffix(".truth.json").read_text())


@pytest.fixture(scope="module")
def prepared():
    return prepare_session(read_telemetry(SESSION))


def test_samples_and_surroundings_are_the_true_ones(prepared, truth):
    data = prepared.observations()
    np.testing.assert_allclose(data.t, truth["t"], atol=1e-9)
    # Amperes; the file has whole milliamperes.
    np.testing.assert_allclose(data.currents, 1e-3 * np.array(truth["currents_clean"]), atol=0.51e-3)
    np.testing.assert_allclose(np.linalg.norm(data.sun_eci, axis=1), 1.0, atol=1e-12)
    # 0.01 deg, and the Sun's 0.05 deg in 4500 s where the truth holds it still.
    np.testing.assert_allclose(data.sun_eci, np.broadcast_to(truth["sun"], data.sun_eci.shape), atol=1.2e-3)
    assert math.remainder(data.greenwich_angle - truth["greenwich0"], 2 * math.pi) == pytest.approx(0.0, abs=1.7e-4)
    assert float(data.orbit.semi_major_axis) == pytest.approx(truth["cfg"]["elements"]["a"], abs=5.0)
    assert data.earth_radius == 6371200.0 and data.earth_rotation_rate == pytest.approx(7.292115e-5, rel=1e-6)


def test_arc_takes_its_ends(prepared):
    data = prepared.observations((64.0, 640.0))
    assert data.t[0] == 64.0 and data.t[-1] == 640.0
    assert len(data.t) == len(data.currents) == len(data.sun_eci) == 10
    with pytest.raises(InputError, match=r"RAW_SUN: arc: no sample between 10 and 20 s; .* from 0 to 4480 s"):
        prepared.observations((10.0, 20.0))


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
    assert given.observations().earth_radius == 6378000.0


def test_satellite_in_si():
    satellite = read_satellite(
        changed={
            "spacecraft.magnet_modulus_A_m2": 0.4,
            "spacecraft.magnet_azimuth_deg": 90.0,
            "spacecraft.rods_A_m2": [0.01, 0.02],
            "spacecraft.imax_mA": 250.0,
            "spacecraft.gains": [1.0, 1.1, 1.2, 1.3, 1.4, 1.5],
            "spacecraft.inertia_kg_m2": {"xx": 0.05, "yy": 0.06, "zz": 0.07, "xy": 1e-3, "xz": 2e-3, "yz": 3e-3},
            "albedo.specular": 0.3,
            "albedo.diffuse": 0.1,
            "spacecraft.panel_tilts_deg": [[0.0, 0.0], [0.0, 2.0], [0.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
        },
    )
    craft = nominal_model(satellite)
    expected = [0, 0.4, 0, 0.01, 0.02, 0.05, 0.06, 0.07, 1e-3, 2e-3, 3e-3, 0.25, 1, 1.1, 1.2, 1.3, 1.4, 1.5, 0.3, 0.1]
    np.testing.assert_allclose(craft.vector()[:20], expected, atol=1e-16)
    tilts = dict(zip(TILTS, np.degrees(craft.vector()[20:]), strict=True))
    assert {name: angle for name, angle in tilts.items() if angle} == {
        "tilts.-x.z": pytest.approx(2.0),
        "tilts.-y.x": pytest.approx(-1.0),
    }
    assert craft.reference_field == 3e-5


def test_choices_are_those_that_there_are():
    fields = FitSettings.model_fields
    assert set(get_args(fields["likelihood"].annotation)) == set(LIKELIHOODS)
    assert set(get_args(fields["solver"].annotation)) == set(EVALUATIONS)
    assert FitSettings(free="alsI23,albedo.diffuse").free_names == ("rods.y", "rods.z", "albedo.diffuse")
    assert FitSettings().changed(free=["rods.z", "magnet.x"]).free_names == ("magnet.x", "rods.z")
    assert FitSettings().changed(free=()).free_names == ()
    for wrong, expected in (
        ({"free": "magnt"}, "Did you mean magnet"),
        ({"noise_mA": -1.0}, "noise_mA"),
        ({"x": 1}, "x"),
    ):
        with pytest.raises(ValueError, match=expected):
            FitSettings().changed(**wrong)
