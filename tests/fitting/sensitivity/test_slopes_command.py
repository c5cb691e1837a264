"""`jaxsat sensitivity SCENARIO`: its files, what it says, and one line for whatever is none."""

import json
from pathlib import Path

import numpy as np
import pytest

from jaxsat.cli.main import run

SLING = '''"""A sling."""

import numpy as np

from jaxsat.sweep import Factory, Knob, Metric, Option, Scenario, number_of


def build(options):
    speed = number_of(options, "speed", low=0.0)

    def run_moved(seed, cases, moved):
        luck = np.array([np.random.default_rng([seed, case]).normal() for case in cases])
        lost = cases % 50 == 0
        length = np.exp(2.0 * moved[:, 0]) * (speed + 0.1 * luck) ** 2 + 4.0 * moved[:, 1]
        hit = np.where(length > 4.0, length / 2.0, np.nan)
        return {
            "status": np.where(lost, 2, np.where(length > 4.0, 0, 1)),
            "length_m": np.where(lost, np.nan, length),
            "hit_s": np.where(lost, np.nan, hit),
        }

    def run(seed, cases):
        return run_moved(seed, cases, np.zeros((len(cases), 2)))

    metrics = {"length_m": Metric("m", "how far"), "hit_s": Metric("s", "until it hits", endless=True)}
    knobs = (Knob("speed", "m/s", "of the sling", speed), Knob("wind", "m/s", "from behind", 0.0, shift=2.0))
    more = {"knobs": knobs, "run_moved": run_moved, "horizon_s": 9.0}
    return Scenario("sling", ("hit", "short", "lost"), metrics, 64, run, **more)


make = Factory(build, (Option("speed", "2", "m/s"),))
'''


@pytest.fixture(autouse=True)
def sling(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    Path("sling.py").write_text(SLING)


def test_files_and_what_is_said(capsys):
    assert run(["sensitivity", "sling.py", "--cases", "300", "--seed", "4", "--set", "speed=2.05", "--out", "s"]) == 0
    said = capsys.readouterr().out
    assert sorted(path.name for path in Path("s").iterdir()) == ["report.html", "slopes.json", "slopes.png"]
    found = json.loads(Path("s/slopes.json").read_text())
    assert found["schema"] == "jaxsat.slopes/1" and found["options"] == {"speed": 2.05} and found["seed"] == 4
    assert found["knobs"]["wind"] == {
        "unit": "m/s",
        "meaning": "from behind",
        "value": 0.0,
        "moved_by": "sum",
        "move": 2.0,
    }
    length = found["metrics"]["length_m"]
    # d/dlog v of v^2 is 2 v^2; a wind of 1 m/s is half a move.
    speed, wind = length["slopes"]["speed"], length["slopes"]["wind"]
    assert speed["effect"] == {"of": "+1 %", "value": 0.01 * speed["slope"], "sigma": 0.01 * speed["sigma"]}
    assert speed["slope"] == pytest.approx(2.0 * length["mean"], rel=0.02)
    assert wind["effect"]["value"] == pytest.approx(2.0) and wind["effect"]["of"] == "+1 m/s"
    assert length["without"] == {"lost": 6} and length["slopes"]["speed"]["left_out"] == 6
    hit = found["metrics"]["hit_s"]
    assert hit["counted_as"] == 9.0 and set(hit["without"]) == {"short", "lost"} and found["ended"]["lost"] == 6
    for words in ("hit_s: ", "count as 9.000 s", "length_m: 6 cases without it (6 lost)", "wind, +1 m/s", "success"):
        assert words in " ".join(said.split()), words
    assert max(map(len, said.splitlines())) <= 80
    page = Path("s/report.html").read_text("utf-8")
    assert f"{found['succeeded']} of 300 cases succeeded" in page and 0 < found["succeeded"] < 294
    assert "Length: " in page and "count as 9.000 s" in page and "data:image/png" in page

    # As a module too, knobs at once, the document alone; another picture is not left from before.
    more = ["--at-once", "--width", "0.02", "--no-plots", "--json", "--out", "s"]
    assert run(["sensitivity", "sling:make", "--by", "wind", "--metrics", "length_m,success", *more]) == 0
    found = json.loads(capsys.readouterr().out)
    assert list(found["knobs"]) == ["wind"] and list(found["metrics"]) == ["length_m", "success"]
    assert found["together"] and found["width"] == 0.02 and not Path("s/slopes.png").exists()
    assert np.isclose(found["metrics"]["length_m"]["slopes"]["wind"]["slope"], 4.0)


@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["sling.py", "--by", "sped"], 2, "sped: no such knob of this scenario; did you mean speed?"),
        (["sling.py", "--metrics", "length"], 2, "length: no such metric of this scenario; did you mean length_m?"),
        (["sling.py", "--width", "3"], 2, "width: expected a number above 0 and at most 1, found 3"),
        (["sling.py", "--cases", "2"], 2, "Must be >= 8"),
        (["sling.py", "--set", "speed"], 2, "Expected NAME=VALUE"),
        (["sling.py", "--set", "sped=1"], 2, "did you mean speed?"),
        (["sling.py", "--free", "magnet"], 2, "a scenario takes --by, --metrics"),
        (["sling.py", "--exact"], 1, "scenario sling has no exact derivatives"),
        (["bare.py"], 1, "scenario sling has no knobs, by which means could be differentiated"),
        (["torn.py"], 1, "torn.py:14: NameError: name 'luk' is not defined"),
        (["none.py"], 1, "none.py: No such file or directory"),
        (["poin"], 1, "poin: no such file, directory or scenario; did you mean point?"),
        (["sat.toml", "--by", "speed"], 2, "--by, --metrics, --set, --cases"),
    ],
)
def test_what_is_none_is_one_line(arguments, status, expected, capsys):
    Path("bare.py").write_text(SLING.replace(", **more", ""))
    Path("torn.py").write_text(SLING.replace("0.1 * luck)", "0.1 * luk)"))
    Path("sat.toml").write_text("")
    assert run(["sensitivity", *arguments, "--no-plots"]) == status
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and expected in lines[0], lines
