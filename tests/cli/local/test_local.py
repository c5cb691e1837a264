"""`jaxsat local` and `jaxsat turn` through the real command: their files, the truth, one line for each mistake."""

import csv
import json
from pathlib import Path

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.bundled import BUNDLED
from jaxsat.cli.main import run

TRUTH = json.loads(BUNDLED.with_name("b-specular50.truth.json").read_text())


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    before = jax.config.read("jax_disable_most_optimizations")
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", before)


def rows(path: str) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def cosines(table: list[dict[str, str]]) -> np.ndarray:
    return np.array([[[float(row[f"a{i}{j}"]) for j in (1, 2, 3)] for i in (1, 2, 3)] for row in table])


@pytest.mark.slow
def test_local_finds_the_attitude_of_a_short_arc(capsys):
    # 320 s has one magnetometer axis only.
    assert run(["local", "--method", "sun-field", "--x", "along", "--arc", "128", "400", "--out", "deep/out"]) == 0
    captured = capsys.readouterr()
    assert "bundled synthetic session" in captured.err and "fewer than two magnetometer axes read" in captured.out
    out = Path("deep/out")
    assert sorted(p.name for p in out.iterdir()) == sorted(
        ["attitude.csv", "attitude.png", "currents.csv", "currents.png", "local.json"]
    )
    assert all((out / name).read_bytes().startswith(b"\x89PNG") for name in ("attitude.png", "currents.png"))
    document = json.loads((out / "local.json").read_text())
    assert (document["schema"], document["program"], document["x"]) == ("jaxsat.local/1", "OrSB", "along")
    assert document["status_counts"] == {"solved": 4, "unsolved": 1}
    assert [sample["t_s"] for sample in document["samples"]] == [128.0, 192.0, 256.0, 320.0, 384.0]
    assert document["samples"][3]["solutions"] == []
    table = rows("deep/out/attitude.csv")
    lit = [0, 1, 2, 4]
    assert [row["solution"] for row in table] == ["1", "1", "1", "", "1"] and table[3]["a11"] == ""
    found = Rotation.from_matrix(cosines([table[k] for k in lit]))
    q = [[float(table[k][f"q_{c}"]) for c in "wxyz"] for k in lit]
    np.testing.assert_allclose((found.inv() * Rotation.from_quat(q, scalar_first=True)).magnitude(), 0.0, atol=1e-8)
    true = Rotation.from_quat(np.array(TRUTH["q"])[[2, 3, 4, 6]], scalar_first=True)
    # The Earth's light moves the Sun by 2 to 10 deg in these samples (`test_local_session` has the bound).
    assert np.degrees((found.inv() * true).magnitude()).max() < 10.0
    currents = rows("deep/out/currents.csv")[0]
    parts = [float(currents[f"{kind}_-y_mA"]) for kind in ("measured", "albedo", "less_albedo")]
    assert parts[0] - parts[1] == pytest.approx(parts[2], abs=1e-6)


@pytest.mark.slow
def test_turn_about_the_field_from_the_published_position():
    assert run(["turn", "--at", "450", "--angle-deg", "0", "--out", "out"]) == 0
    document = json.loads(Path("out/turn.json").read_text())
    assert (document["schema"], document["t_s"], document["about"]) == ("jaxsat.turn/1", 448.0, "field")
    axes = np.array(document["direction_cosines"])
    np.testing.assert_allclose(axes[:, 0], document["axis_eci"], atol=1e-12)
    assert axes[2, 1] == pytest.approx(0.0, abs=1e-12), "y lies in the plane OXY"
    table = rows("out/turn.csv")
    turned = Rotation.from_matrix(cosines(table))
    assert len(table) == 360
    np.testing.assert_allclose(turned[0].as_matrix(), axes, atol=1e-9)
    # By the right hand about the inertial axis.
    step = (turned[30] * turned[0].inv()).as_rotvec(degrees=True)
    np.testing.assert_allclose(step, 30.0 * np.array(document["axis_eci"]), atol=1e-6)
    field = np.array([[float(row[f"field_{c}_uT"]) for c in "xyz"] for row in table])
    np.testing.assert_allclose(field[:, 1:], 0.0, atol=1e-9)
    # Noise of 2 mA.
    np.testing.assert_allclose(document["measured_mA"], TRUTH["currents_clean"][7], atol=8.0)
    for name in ("turn.png", "space.png"):
        assert Path("out", name).read_bytes().startswith(b"\x89PNG")
    assert '"turn":' in Path("out/turn.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["local", "--method", "sun"], 2, '"field-roll", "five-parameter", "sun-field"'),
        (["local", "--albedo-max", "-1"], 2, "Must be >= 0"),
        (["local", "--direct-sigma", "0", "--method", "five-parameter"], 2, "Must be > 0"),
        (["local", "--direct-sigma", "0.1"], 2, "--direct-sigma is for --method five-parameter"),
        (["local", "--arc", "5", "1"], 2, "first before the second"),
        (["turn", "--angle-deg", "nan"], 2, "Expected a finite number"),
        (["turn", "--axis-body", "0", "0", "0"], 2, "Expected a direction, not zeros"),
        (["local", "--axis-body", "nan", "0", "0"], 2, "Expected a finite number"),
        (["local", "--axis-body", "1", "0", "0", "--method", "sun-field"], 2, "--axis-body is for the other methods"),
        (["local", "none.RAW_SUN"], 1, "none.RAW_SUN: no such file"),
        (["turn", "none.RAW_SUN"], 1, "none.RAW_SUN: no such file"),
        (["local", "bad.RAW_SUN"], 1, "bad.RAW_SUN:6: position Y [km]: "),
        (["turn", "bad.RAW_SUN"], 1, "bad.RAW_SUN:6: position Y [km]: "),
        (["local", "good.RAW_SUN", "--arc", "1e6", "2e6"], 1, "good.RAW_SUN: arc: no sample"),
        (["local", "good.RAW_SUN", "--arc", "2752", "3900"], 1, "samples are in shadow"),
        (["turn", "good.RAW_SUN", "--at", "99999"], 1, "at: no sample within 64 s of t = 99999 s; they run from 0 to"),
        (["turn", "good.RAW_SUN", "--about", "sun", "--at", "3000"], 1, "at: no panel shows 2 mA at t = 3008 s"),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing(arguments, status, expected, capsys):
    good = BUNDLED.read_text()
    Path("good.RAW_SUN").write_text(good)
    changed = good.splitlines()
    fields = changed[5].split()
    fields[13] = "seven"
    changed[5] = " ".join(fields)
    Path("bad.RAW_SUN").write_text("\n".join(changed) + "\n")
    assert run(arguments) == status
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    assert captured.err.startswith("jaxsat: error: ") and expected in captured.err
    assert sorted(p.name for p in Path().iterdir()) == ["bad.RAW_SUN", "good.RAW_SUN"]


@pytest.mark.slow
def test_a_session_without_any_attitude_has_status_3(capsys):
    # Three panels are lit at most: the Earth's light is off there.
    arguments = ["--arc", "4150", "4480", "--drop", "4280", "4290", "--no-plots", "--out", "out"]
    assert run(["local", "--method", "five-parameter", *arguments]) == 3
    assert "fewer than 4 panels show 2 mA" in capsys.readouterr().out
    document = json.loads(Path("out/local.json").read_text())
    assert set(document["status_counts"]) == {"unsolved"} and len(document["samples"]) == 5
