"""`jaxsat simulate`: its session against one that another program made, what it writes, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.cli.main import run
from jaxsat.cli.settings.files import load_config
from jaxsat.errors import InputError
from jaxsat.synthetic.files import SMOOTH_DEG, fine_truth
from jaxsat.synthetic.panels import further_panels, panel_columns
from jaxsat.synthetic.session import SessionPlan, make_session
from jaxsat.telemetry import clean, read_raw_sun
from jaxsat.telemetry.elements.tle_lines import check_tle_lines

TRUTH = Path(__file__).parents[2] / "jaxsat" / "data" / "munin" / "c-specular50-limited.truth.json"
ORDER = ["-Z", "+X", "-X", "+Y", "-Y", "+Z"]


def settings(**more):
    """Session c of the bundled ones, as a configuration."""
    truth = json.loads(TRUTH.read_text())
    cfg, e, J = truth["cfg"], truth["cfg"]["elements"], truth["cfg"]["inertia"]
    return {
        "orbit.semi_major_axis_km": e["a"] / 1e3,
        "orbit.eccentricity": e["e"],
        "orbit.inclination_deg": e["i"],
        "orbit.raan_deg": e["raan"],
        "orbit.argument_of_perigee_deg": e["argp"],
        "orbit.time_of_perigee_s": e["t_peri"],
        "sun.direction_eci": truth["sun"],
        "spacecraft.magnet_A_m2": cfg["magnet"],
        "spacecraft.rods_A_m2": cfg["rods"],
        "spacecraft.imax_mA": cfg["imax"],
        "spacecraft.inertia_kg_m2": {
            name: J["xyz".index(name[0])]["xyz".index(name[1])] for name in ("xx", "yy", "zz", "xy", "xz", "yz")
        },
        "albedo.specular": cfg["albedo_specular"],
        "simulate.quaternion": cfg["q0"],
        "simulate.rate_deg_s": np.degrees(cfg["w0"]).tolist(),
        "simulate.limit_s": cfg["clip"][:2],
        "simulate.limit_factors": cfg["clip"][2:],
        **{key.replace("__", "."): value for key, value in more.items()},
    }


def plan(overrides) -> SessionPlan:
    config = load_config(overrides=overrides)
    return SessionPlan(config.simulate, config.numbers, config.given, config.cleaning)


@pytest.fixture(scope="module")
def session():
    return make_session(plan(settings(cleaning__panel_order=ORDER)))


@pytest.mark.slow
def test_greenwich_at_a_perigee_of_the_orbit_that_is_flown():
    """The default orbit's perigee is 3230.5 s after t = 0; 191.28 deg in Table 1 of Penkov et al. 2009."""
    found = make_session(plan({"earth.greenwich_angle_at_perigee_deg": 204.78}))
    expected = 204.78 - 3230.533197 * 360.98564737 / 86400
    assert np.degrees(found.greenwich_angle) == pytest.approx(expected, abs=1e-4)
    assert expected == pytest.approx(191.28, abs=0.005)


@pytest.mark.slow
def test_the_session_is_that_of_another_program(session):
    theirs, ours = json.loads(TRUTH.read_text()), session.truth
    # Measured 5e-10 deg between attitudes: both integrate to 1e-9 or better.
    overlap = np.abs(np.sum(np.asarray(ours.quaternion) * np.array(theirs["q"]), axis=1))
    assert np.max(1.0 - overlap) < 1e-15
    np.testing.assert_allclose(ours.angular_velocity, theirs["w"], atol=1e-9)
    np.testing.assert_allclose(np.degrees(ours.sun_magnetic[:, 0]), theirs["theta"], atol=1e-5)
    # 3e-6 mA: they solve the mirror's equation to 1e-10.
    np.testing.assert_allclose(1e3 * np.asarray(ours.current), theirs["currents_clean"], atol=1e-5)
    np.testing.assert_array_equal(np.asarray(ours.illumination) > 0.5, theirs["lit"])
    # Curves of pictures: through the samples, and turning between them as the rates say.
    fine = fine_truth(session)
    parts = (len(fine.t) - 1) // (len(ours.t) - 1)
    assert np.array_equal(fine.t[::parts], ours.t) and np.array_equal(fine.quaternion[::parts], ours.quaternion)
    turns = Rotation.from_quat(fine.quaternion, scalar_first=True)
    turned_deg = np.degrees((turns[:-1].inv() * turns[1:]).as_rotvec())
    mean_deg_s = np.degrees(0.5 * (fine.angular_velocity[1:] + fine.angular_velocity[:-1]))
    assert np.linalg.norm(turned_deg, axis=1).max() < 1.05 * SMOOTH_DEG
    # The trapezoid rule of some 5 s.
    np.testing.assert_allclose(turned_deg / np.diff(fine.t)[:, None], mean_deg_s, atol=2e-3)


@pytest.mark.slow
def test_the_charge_current_is_limited_in_its_interval_alone(session):
    clean_mA, t = 1e3 * np.asarray(session.truth.current), session.truth.t
    within = (t >= 2000) & (t <= 2500)
    np.testing.assert_array_equal(session.limited_mA[~within], clean_mA[~within])
    np.testing.assert_allclose(session.limited_mA[within], clean_mA[within] * [0.7, 0.7, 0.55, 0.55, 0.8, 0.8])
    seen = clean_mA > 10.0
    noise = (session.telemetered_mA - session.limited_mA)[seen]
    # 200 readings of 2 mA and a step of 1 mA.
    assert np.std(noise) == pytest.approx(2.02, rel=0.2) and np.all(session.telemetered_mA[clean_mA == 0.0] == 0.0)


@pytest.mark.slow
def test_the_reader_takes_every_row(session, tmp_path):
    path = tmp_path / "session.RAW_SUN"
    path.write_text(session.raw_sun)
    raw = read_raw_sun(path)
    made = plan(settings(cleaning__panel_order=ORDER))
    found = clean(raw, made.cleaning, made.satellite)
    check_tle_lines(raw.tle)
    assert not found.rejections and len(found.t_s) == len(session.truth.t)
    np.testing.assert_allclose(found.t_s, session.truth.t, atol=1e-3)
    np.testing.assert_array_equal(found.currents_mA, session.telemetered_mA)
    assert found.epoch.iso(3) == session.epoch.iso(3)
    position_error = found.position_eci_m - np.asarray(session.truth.position_eci)
    assert 200.0 < np.std(position_error) < 400.0
    field_error = found.b_field_uT - 1e6 * np.asarray(session.truth.b_field_body)[:, 1:]
    assert 0.2 < np.std(field_error) < 0.4


@pytest.mark.slow
def test_panels_of_any_outline_see_what_the_box_sees(session):
    corners = [[0.1, -0.1, -0.1], [0.1, 0.1, -0.1], [0.1, 0.1, 0.1], [0.1, -0.1, 0.1]]
    triangle = [[0.0, 0.0, 0.1], [0.1, 0.0, 0.1], [0.0, 0.1, 0.1]]
    density = json.loads(TRUTH.read_text())["cfg"]["imax"] / 0.04
    given = {"simulate__panel_corners_m": [corners, triangle], "simulate__panel_density_mA_m2": density}
    made = plan(settings(**given))
    panels = further_panels(made.settings)
    assert panels is not None
    radius, mirror = 1e3 * made.given.earth.radius_km, made.satellite.albedo.specular
    found = panel_columns(panels, session.truth, earth_radius=radius, reflectivity=mirror)
    # The triangle is an eighth of its face.
    for number, face, share in ((1, 0, 1.0), (2, 4, 0.125)):
        for kind in ("direct", "specular"):
            of_box = 1e3 * share * np.asarray(getattr(session.truth, f"{kind}_current"))[:, face]
            assert of_box.max() > 1.0
            # A mirror as round as the Earth does not send quite parallel light: 1e-7 over 0.2 m.
            name = f"{kind.replace('specular', 'mirrored')}_{number}_mA"
            np.testing.assert_allclose(found[name], of_box, atol=1e-4)


@pytest.mark.slow
def test_the_command_writes_what_it_says(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    config = tmp_path / "x.toml"
    config.write_text("[simulate]\nsatellite = 'TEST'\nzero_offset_mA = 3.0\nnoise_mA = 0.0\nnoise = 'uniform'\n")
    assert run(["simulate", str(config), "--seed", "5", "--out", str(tmp_path / "sim"), "--no-plots"]) == 0
    assert "TEST: 71 samples" in " ".join(capsys.readouterr().out.split())
    out = tmp_path / "sim"
    assert sorted(p.name for p in out.iterdir()) == [
        *("angles.csv", "currents.csv", "limb.csv", "session.RAW_SUN", "session.truth.json")
    ]
    truth = json.loads((out / "session.truth.json").read_text())
    assert truth["schema"] == "jaxsat.truth/1" and truth["cfg"]["seed"] == 5 and len(truth["q"]) == 71
    assert truth["theta"][0] == pytest.approx(12.0, abs=1e-9)
    bundled = json.loads(TRUTH.read_text())
    assert set(bundled) <= set(truth) and set(bundled["cfg"]) <= set(truth["cfg"])
    dark = clean(read_raw_sun(out / "session.RAW_SUN")).currents_mA[~np.array(truth["lit"])]
    np.testing.assert_array_equal(dark, 3.0)
    header = (out / "angles.csv").read_text().splitlines()[0].split(",")
    assert {"sun_magnetic_azimuth_deg", "sun_magnetic_roll_deg", "limb_distance_deg", "limb_turn_deg"} <= set(header)
    assert (out / "limb.csv").read_text().count("\n") == 72


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("epoch_utc", "2001-13-18T00:00:00", "month must be in 1..12"),
        ("epoch_utc", "2001-01-18", "expected a UTC instant"),
        ("epoch_utc", "2050-01-18T00:00:00", "range of IGRF-14"),
        ("duration_s", 100.0, "expected 3 to"),
        ("quaternion", [0.0, 0.0, 0.0, 0.0], "expected a quaternion that is not zero"),
        ("tle", ["1 x", "2 x"], "expected 69 characters"),
        ("limit_sum_mA", 100.0, "act within limit_s"),
        ("panel_corners_m", [[[0.1, 0, 0], [0.1, 0.1, 0], [0.1, 0.1, 0.1], [0.2, 0, 0.1]]], "panel 0: not flat"),
        ("satellite", "two\nlines", "one line of plain text"),
        ("noise_mA", float("nan"), "finite"),
        ("samplings", 1.0, "did you mean 'sampling_s'?"),
    ],
)
def test_bad_settings_are_one_line(key, value, expected):
    with pytest.raises(InputError, match=f"simulate.*{expected}") as error:
        make_session(plan({f"simulate.{key}": value}))
    assert "\n" not in str(error.value)


def test_an_orbit_inside_the_earth_is_refused():
    low = settings(orbit__semi_major_axis_km=6700.0)
    with pytest.raises(InputError, match="orbit: the perigee lies"):
        make_session(plan(low))
