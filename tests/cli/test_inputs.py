"""From a prepared session and a configuration to the fit's SI input, against the truth beside the sessions."""

import json
import math

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters.names import TILTS
from jaxsat.cli.session.inputs import fit_settings, nominal, observations, surroundings
from jaxsat.cli.session.prepared import BUNDLED, prepare_session
from jaxsat.cli.settings.files import load_config
from jaxsat.errors import InputError

SESSION = BUNDLED.with_name("a-nominal-exact.RAW_SUN")


@pytest.fixture(scope="module")
def truth():
    return json.loads(SESSION.with_suffix(".truth.json").read_text())


@pytest.fixture(scope="module")
def prepared():
    return prepare_session(SESSION, load_config())


def observe(prepared, **overrides):
    config = load_config(None, {key.replace("__", "."): value for key, value in overrides.items()})
    return observations(prepared.session, prepared.orbit_fit, config)


def test_samples_and_surroundings_are_the_true_ones(prepared, truth):
    data = observe(prepared)
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
    data = observe(prepared, fit__arc_s=[64.0, 640.0])
    assert data.t[0] == 64.0 and data.t[-1] == 640.0
    assert len(data.t) == len(data.currents) == len(data.sun_eci) == 10
    with pytest.raises(InputError, match=r"RAW_SUN: arc: no sample between 10 and 20 s; .* from 0 to 4480 s"):
        observe(prepared, fit__arc_s=[10.0, 20.0])


def test_configuration_takes_the_place_of_what_is_found(prepared):
    """Table 1 of Penkov et al. 2009: elements, Greenwich angle at perigee and Sun as published."""
    config = load_config(
        None,
        {
            "orbit.inclination_deg": 95.438873,
            "orbit.raan_deg": 64.81879,
            "orbit.argument_of_perigee_deg": 16.675906,
            "orbit.eccentricity": 0.072661,
            "orbit.semi_major_axis_km": 7630.026457,
            "orbit.time_of_perigee_s": 3230.533197,
            "earth.greenwich_angle_at_perigee_deg": 204.78,
            "earth.radius_km": 6378.0,
            "sun.direction_eci": [0.47176670, -0.80932067, -0.34990890],
        },
    )
    given = prepare_session(prepared.session.path, config)
    around = surroundings(given.session, given.orbit_fit, config)
    position, _ = given.orbit_fit.orbit(jnp.asarray(3230.533197))
    # The exact session flew these elements, to the digits published.
    assert given.orbit_fit.rms_after_m < 1.0 and "given by the configuration" in given.orbit_fit.message
    # At perigee: a (1 - e) from the centre.
    assert np.linalg.norm(position) == pytest.approx(7630026.457 * (1 - 0.072661), rel=1e-9)
    assert math.degrees(around.greenwich_angle) == pytest.approx(204.78 - 3230.533197 * 360.98564737 / 86400, abs=1e-4)
    assert around.sun_eci.shape == (71, 3) and np.ptp(around.sun_eci, axis=0).max() == 0.0
    np.testing.assert_allclose(np.linalg.norm(around.sun_eci, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(around.sun_eci[0], [0.47176670, -0.80932067, -0.34990890], atol=1e-7)
    assert observations(prepared.session, prepared.orbit_fit, config).earth_radius == 6378000.0


def test_satellite_in_si():
    config = load_config(
        None,
        {
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
    craft = nominal(config)
    expected = [0, 0.4, 0, 0.01, 0.02, 0.05, 0.06, 0.07, 1e-3, 2e-3, 3e-3, 0.25, 1, 1.1, 1.2, 1.3, 1.4, 1.5, 0.3, 0.1]
    np.testing.assert_allclose(craft.vector()[:20], expected, atol=1e-16)
    tilts = dict(zip(TILTS, np.degrees(craft.vector()[20:]), strict=True))
    assert {name: angle for name, angle in tilts.items() if angle} == {
        "tilts.-x.z": pytest.approx(2.0),
        "tilts.-y.x": pytest.approx(-1.0),
    }
    assert craft.reference_field == 3e-5


def test_every_key_of_the_fit_arrives():
    chosen = {
        "free": "alsI23,albedo.diffuse",
        "starts": 17,
        "seed": 5,
        "noise_mA": 1.5,
        "quantum_mA": 0.5,
        "zero_is_floor": False,
        "max_rate_deg_s": 2.5,
        "step_s": 20.0,
        "likelihood": "student",
        "solver": "lbfgs",
    }
    priors = {
        "magnet_A_m2": 0.1,
        "rods_A_m2": 0.2,
        "imax_relative": 0.3,
        "gains": 0.4,
        "inertia_relative": 0.5,
        "albedo": 0.6,
        "tilts_deg": 0.7,
    }
    settings = fit_settings(load_config(None, {f"fit.{k}": v for k, v in chosen.items()} | {"fit.prior_sigma": priors}))
    assert settings.free == ("rods.y", "rods.z", "albedo.diffuse")
    for name in set(chosen) - {"free"}:
        assert getattr(settings, name) == chosen[name]
    prior = settings.prior
    assert (prior.magnet, prior.rods, prior.imax_relative) == (0.1, 0.2, 0.3)
    assert (prior.gains, prior.inertia_relative, prior.albedo) == (0.4, 0.5, 0.6)
