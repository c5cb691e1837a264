"""`jaxsat fit` on real files: the files it promises, their schema, their truth, and many sessions at once."""

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from jaxsat.bundled import BUNDLED
from jaxsat.cli.main import run

pytestmark = pytest.mark.slow

SESSION = BUNDLED.with_name("a-nominal-exact.RAW_SUN")
FIT = ["--free", "state", "--starts", "64", "--seed", "0"]
FILES = [
    *("attitude.csv", "attitude.png", "channel-cells.csv", "channel-cells.png", "channel-mag.csv", "channel-mag.png"),
    *("curves.json", "field_angle.png", "fit.json", "orbit.png", "provenance.json", "report.html", "scene.json"),
]
UNITS = {
    **{f"magnet.{c}": "A m2" for c in "xyz"},
    **{f"rods.{c}": "A m2" for c in "yz"},
    "imax": "mA",
    **{f"gains.{sign}{c}": "1" for c in "xyz" for sign in "+-"},
    **{f"inertia.{c}": "kg m2" for c in ("xx", "yy", "zz", "xy", "xz", "yz")},
    **{f"albedo.{kind}": "1" for kind in ("specular", "diffuse")},
}


@pytest.fixture(autouse=True, scope="module")
def test_session_keeps_its_jax():
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
        yield


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """The session's results by the command, under a name of its own."""
    folder = tmp_path_factory.mktemp("fit")
    path = folder / "night 7.RAW_SUN"
    shutil.copy(SESSION, path)
    assert run(["fit", str(path), *FIT, "--out", str(folder / "out")]) == 0
    return path, folder / "out"


@pytest.fixture(scope="module")
def document(fitted):
    return json.loads((fitted[1] / "fit.json").read_text(), parse_constant=lambda name: pytest.fail(f"{name} in JSON"))


def attitude_error_deg(attitude) -> np.ndarray:
    true = json.loads(SESSION.with_suffix(".truth.json").read_text())
    np.testing.assert_allclose(attitude["t_s"], true["t"], atol=1e-6)
    overlap = np.abs(np.sum(np.array(attitude["quaternion_inertial_from_body"]) * np.array(true["q"]), axis=1))
    return np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0)))


def test_every_promised_file_is_there_and_no_other(fitted):
    path, out = fitted
    assert sorted(entry.name for entry in out.iterdir()) == FILES
    assert sorted(entry.name for entry in path.parent.iterdir()) == ["night 7.RAW_SUN", "out"]
    for name in FILES:
        data = (out / name).read_bytes()
        assert len(data) > 1000 and (not name.endswith(".png") or data.startswith(b"\x89PNG"))


def test_fit_json_is_exactly_its_schema(fitted, document):
    assert list(document) == [
        *("schema", "telemetry", "epoch_utc", "status", "message", "verdict", "chi2", "dof", "residual_rms_mA"),
        *("residual_rms", "holdout", "witness", "parameters", "gauge", "unseen", "buys", "correlations", "axes"),
        *("alternatives", "causes", "delays", "breaks", "channels", "rejections", "attitude", "orbit"),
        *("diagnostics", "profiles", "timing_s"),
    ]
    assert document["schema"] == "jaxsat.fit/1" and document["telemetry"] == str(fitted[0])
    assert document["epoch_utc"] == "2001-01-18T04:54:15.000"
    assert document["status"] == "converged" and isinstance(document["message"], str)
    assert isinstance(document["chi2"], float) and isinstance(document["dof"], int)
    assert 0.0 < document["residual_rms_mA"] < 1.0 and document["gauge"] is None
    assert {name: p["unit"] for name, p in document["parameters"].items() if name in UNITS} == UNITS
    for p in document["parameters"].values():
        assert list(p) == ["value", "sigma", "unit", "free"]
        assert isinstance(p["value"], float) and p["sigma"] is None and p["free"] is False
    pairs = [(a, b) for a, row in document["correlations"].items() for b in row]
    assert len(pairs) == len(set(map(frozenset, pairs))) == 15
    assert all(-1.0 <= value <= 1.0 for row in document["correlations"].values() for value in row.values())
    assert list(document["timing_s"]) == ["import", "prepare", "compile", "solve", "total"]
    assert all(isinstance(value, float) and value >= 0 for value in document["timing_s"].values())
    assert document["timing_s"]["total"] >= document["timing_s"]["solve"]


def test_attitude_is_that_of_the_truth(document):
    attitude = document["attitude"]
    shapes = {name: np.shape(values) for name, values in attitude.items()}
    assert shapes == {
        "t_s": (71,),
        "quaternion_inertial_from_body": (71, 4),
        "angular_velocity_rad_s": (71, 3),
        "attitude_sigma_deg": (71, 3),
        "fitted": (71,),
        "field_angle_deg": (71,),
        "field_angle_sigma_deg": (71,),
    }
    true = json.loads(SESSION.with_suffix(".truth.json").read_text())
    assert np.sqrt(np.mean(attitude_error_deg(attitude) ** 2)) <= 0.3
    assert np.abs(np.array(attitude["field_angle_deg"]) - true["theta"]).max() <= 0.5


def test_tables_say_the_same_as_fit_json(fitted, document):
    with (fitted[1] / "attitude.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    q = [[float(row[f"q_{c}"]) for c in "wxyz"] for row in rows]
    np.testing.assert_allclose(q, document["attitude"]["quaternion_inertial_from_body"], rtol=1e-9, atol=1e-10)
    assert rows[1]["utc"] == "2001-01-18T04:55:19.000" and rows[0]["t_s"] == "0"
    lit = json.loads(SESSION.with_suffix(".truth.json").read_text())["lit"]
    assert [row["lit"] == "1" for row in rows] == lit


def test_a_guess_takes_the_place_of_the_search(fitted, document, tmp_path):
    path, out = fitted
    assert run(["fit", str(path), *FIT, "--guess", str(out), "--no-plots", "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out/fit.json").read_text())
    assert found["chi2"] == pytest.approx(document["chi2"], rel=1e-6)
    assert any("nothing else was searched" in line for line in found["verdict"])
    assert run(["fit", str(path), str(path), "--guess", str(out)]) == 2


def test_many_files_with_one_bad(fitted, tmp_path, capsys):
    bad = tmp_path / "bad.RAW_SUN"
    bad.write_text("MUNIN\n")
    out = tmp_path / "all"
    assert run(["fit", str(fitted[0]), str(bad), str(SESSION), *FIT, "--no-plots", "--out", str(out)]) == 1
    summary = json.loads((out / "summary.json").read_text())
    assert summary["counts"] == {"converged": 2, "ambiguous": 0, "not_converged": 0, "failed": 1}
    assert [entry["directory"] for entry in summary["files"]] == ["night 7", None, "a-nominal-exact"]
    assert sorted(entry.name for entry in out.iterdir()) == ["a-nominal-exact", "night 7", "summary.json"]
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("jaxsat: error: ")]
    assert len(errors) == 1 and str(bad) in errors[0]
    one, two = (json.loads((out / name / "fit.json").read_text()) for name in ("night 7", "a-nominal-exact"))
    assert one["attitude"] == two["attitude"] and "synthetic" in two["telemetry"]
    assert sorted(entry.name for entry in (out / "night 7").iterdir()) == [n for n in FILES if n[-4:] != ".png"]


def test_console_script_does_the_same(document, tmp_path):
    """The installed command in a process of its own: programs that went through the disk."""
    command = [str(Path(sys.executable).with_name("jaxsat")), "fit", str(SESSION), *FIT, "--no-plots"]
    done = subprocess.run([*command, "--out", str(tmp_path / "out")], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (
        "Fits. One motion explains the data" in done.stdout
        and "growing arcs" in done.stderr
        and "Traceback" not in done.stderr
    )
    attitude = json.loads((tmp_path / "out" / "fit.json").read_text())["attitude"]
    assert np.sqrt(np.mean(attitude_error_deg(attitude) ** 2)) <= 0.3
    for name, values in attitude.items():
        np.testing.assert_allclose(values, document["attitude"][name], rtol=1e-5, atol=1e-5)
    assert list(Path(os.environ["JAX_COMPILATION_CACHE_DIR"]).glob("*.stablehlo"))


def test_console_script_answers_bad_input_in_one_line(tmp_path):
    command = [str(Path(sys.executable).with_name("jaxsat")), "fit", "missing.RAW_SUN", "--out", "out"]
    environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": str(tmp_path / "xla")}
    (tmp_path / "work").mkdir()
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path / "work", env=environment)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "jaxsat: error: missing.RAW_SUN: no such file; expected a RAW_SUN file\n"
    assert list((tmp_path / "work").iterdir()) == []
