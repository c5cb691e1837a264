"""`jaxsat export`: a fit's directory in each format, and what is refused; what docs/howto/results.md reads is there."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.cli.main import run
from jaxsat.telemetry.ccsds.aem import read_aem
from jaxsat.telemetry.ccsds.oem import read_oem

PAGE = (Path(__file__).parents[2] / "docs" / "howto" / "results.md").read_text("utf-8")


@pytest.fixture
def fitted(fitted_run, tmp_path, monkeypatch):
    """A fit's directory: attitudes made up, orbit that of the bundled session."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(fitted_run, "fit")
    with open("fit/fit.json") as stream:
        return json.load(stream)


def test_every_format_says_the_same(fitted, capsys):
    formats = ("aem", "aem1", "oem", "czml", "csv", "parquet")
    assert run(["export", "fit", *(x for f in formats for x in ("--format", f)), "--out", "out"]) == 0
    assert "MUNIN" in capsys.readouterr().out
    with open("out/export.json") as stream:
        document = json.load(stream)
    assert document["schema"] == "jaxsat.export/1" and set(document["files"]) == set(formats)
    attitude, orbit = fitted["attitude"], fitted["orbit"]
    q = np.array(attitude["quaternion_inertial_from_body"])
    for name, frame in (("attitude.aem", "TOD_EARTH"), ("attitude-v1.aem", "TOD")):
        (found,) = read_aem(f"out/{name}")
        assert (found.frame_a, found.object_name, found.object_id) == (frame, "MUNIN", "2000-075C")
        np.testing.assert_allclose(found.quaternion_a_from_b, q, atol=2e-12)
        np.testing.assert_allclose(found.t_s, attitude["t_s"], atol=1e-6)
        assert found.epoch.iso(3) == fitted["epoch_utc"]
    (states,) = read_oem("out/orbit.oem")
    np.testing.assert_allclose(states.position_m, orbit["position_eci_m"], atol=1e-3)
    # Kepler's own speed: between the samples the positions move as the velocities say.
    moved = np.diff(states.position_m, axis=0) / np.diff(states.t_s)[:, None]
    mean = 0.5 * (states.velocity_m_s[1:] + states.velocity_m_s[:-1])
    assert np.max(np.linalg.norm(moved - mean, axis=1)) < 5.0
    table = pq.read_table("out/session.parquet")
    assert table.schema.metadata[b"frame"] == b"tod"
    np.testing.assert_array_equal(np.column_stack([table[f"q_{c}"] for c in "wxyz"]), q)
    with open("out/session.csv") as stream:
        header, first, *_ = stream.read().splitlines()
    assert header.split(",") == table.column_names
    assert float(first.split(",")[2]) == q[0, 0]
    with open("out/session.czml") as stream:
        assert [packet["id"] for packet in json.load(stream)] == ["document", "satellite"]
    with open("out/orbit.oem") as stream:
        assert "COMMENT Kepler orbit fitted to the positions of a telemetry session." in stream.read()


def test_other_axes_turn_attitude_and_orbit_alike(fitted):
    assert run(["export", "fit", "--frame", "eme2000", "--object-id", "2000-999A", "--out", "out"]) == 0
    (attitude,), (orbit,) = read_aem("out/attitude.aem"), read_oem("out/orbit.oem")
    assert attitude.frame_a == orbit.frame == "EME2000" and attitude.object_id == "2000-999A"
    of_date = Rotation.from_quat(np.roll(fitted["attitude"]["quaternion_inertial_from_body"], -1, axis=1))
    celestial = Rotation.from_quat(np.roll(attitude.quaternion_a_from_b, -1, axis=1))
    # Nadir in body axes is the same whatever the inertial ones.
    before, after = of_date.inv().apply(fitted["orbit"]["position_eci_m"]), celestial.inv().apply(orbit.position_m)
    np.testing.assert_allclose(after, before, atol=0.01)
    # A year of precession, 50", and nutation.
    assert 1e-5 < np.max((of_date.inv() * celestial).magnitude()) < 4e-4


def edit(**changes):
    with open("fit/fit.json") as stream:
        document = json.load(stream)
    for key, value in changes.items():
        *path, last = key.split("__")
        place = document
        for part in path:
            place = place[part]
        if value is None:
            del place[last]
        else:
            place[last] = value
    with open("fit/fit.json", "w") as stream:
        json.dump(document, stream)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"schema": "jaxsat.fit/2"}, "schema: expected jaxsat.fit/1, got jaxsat.fit/2"),
        ({"orbit": None}, "holds no orbit"),
        ({"epoch_utc": "yesterday"}, "expected a UTC instant"),
        ({"attitude__t_s": [0.0]}, "shape"),
        ({"attitude__quaternion_inertial_from_body": [[2.0, 0, 0, 0]] * 71}, "unit quaternions"),
        ({"attitude__angular_velocity_rad_s": None}, "attitude.angular_velocity_rad_s: Field required"),
        ({"orbit__object_name": "two\nlines"}, "orbit.object_name: character U+000A has no place"),
        ({"orbit__position_eci_m": "x"}, "orbit.position_eci_m: Input should be a valid list"),
        ({"channels": []}, "channels: Input should be"),
    ],
)
def test_damaged_fits_are_one_line(changes, expected, fitted, capsys):
    edit(**changes)
    capsys.readouterr()
    assert run(["export", "fit", "--format", "oem", "--out", "out"]) == 1
    error = capsys.readouterr().err
    assert expected in error and "fit.json" in error and error.count("\n") == 1


def test_wrong_usage_and_missing_runs(fitted, capsys):
    assert run(["export", "nowhere"]) == 1
    assert run(["export", "fit", "--format", "xml"]) == 2
    assert "--format" in capsys.readouterr().err


def test_names_that_matlab_asks_for_are_there(fitted_run):
    (code,) = re.findall(r"^```matlab\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)
    document = json.loads((fitted_run / "fit.json").read_text("utf-8"))
    head = (fitted_run / "attitude.csv").read_text("utf-8").partition("\n")[0].split(",")
    for path in re.findall(r"\bfit((?:\.\w+)+)", code.replace('"fit.json"', "")):
        inner = document
        for key in path[1:].split("."):
            inner = inner[key]
    assert set(re.findall(r"motion\.(\w+)", code)) <= set(head)
    # As the format of its datetime has it.
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}", document["epoch_utc"])


def test_cesium_finds_the_satellite_by_its_name(fitted_run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["export", str(fitted_run), "--format", "czml", "--out", "munin-out"]) == 0
    packets = json.loads(Path("munin-out/session.czml").read_text("utf-8"))
    assert 'getById("satellite")' in PAGE and packets[1]["id"] == "satellite"
