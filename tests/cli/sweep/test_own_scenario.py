"""A scenario in a file of one's own: the template runs, the file is part of the sweep, its errors are one line."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from jaxsat.cli.main import run
from jaxsat.sweep import CodeError, Source

DART = '''"""A dart."""

import numpy as np

from jaxsat.sweep import Factory, Input, Metric, Option, Scenario, number_of


def draw(seed, cases):
    return np.array([np.random.default_rng([seed, case]).normal() for case in cases])


def build(options):
    spread = number_of(options, "spread_deg", low=0.0)

    def run(seed, cases):
        miss = spread * np.abs(draw(seed, cases))
        return {"status": np.where(miss < 1.0, 0, 1), "miss_deg": miss}

    inputs = (Input("throw", "deg", "to the right", lambda drawn: drawn),)
    metrics = {"miss_deg": Metric("deg", "by how much")}
    return Scenario("dart", ("hit", "missed"), metrics, 8, run, inputs=inputs, draw=draw)


make = Factory(build, (Option("spread_deg", "1", "1-sigma of the throw"),))
'''
FEW = ["--cases", "20", "--no-plots", "-q"]


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def test_the_template_is_refused_where_a_file_is_and_runs_as_it_stands(capsys):
    Path("there.py").write_text("mine")
    assert run(["sweep", "--new", "there.py"]) == 1
    assert "there.py: is there already" in capsys.readouterr().err and Path("there.py").read_text() == "mine"
    assert run(["sweep", "--new", "my_cube.py"]) == 0
    assert "jaxsat sweep my_cube.py --cases 1000" in capsys.readouterr().out
    # Without spread of the inertia nothing is drawn of it.
    short = ["--set", "hours=0.02", "--set", "inertia=0"]
    assert run(["sweep", "my_cube.py", "--list", *short]) == 0
    listed = capsys.readouterr().out
    for word in ("my-cube: a 3U CubeSat", "tipoff_deg_s", "detumbling_time_s", "in_rate_x_deg_s", "assumed:"):
        assert word in listed
    assert "in_inertia_xx_kg_m2" not in listed
    assert run(["sweep", "my_cube.py", "--cases", "6", "--seed", "2", "--out", "r", "--no-plots", *short]) == 0
    table = pq.read_table("r/cases.parquet").to_pylist()
    assert len(table) == 6 and {row["status"] for row in table} <= {"succeeded", "still tumbling"}
    summary = json.loads(Path("r/summary.json").read_text())
    assert len(summary["assumptions"]) == 2 and summary["options"]["hours"] == 0.02
    # Coils take energy out, so that the fastest do not get faster.
    began = np.array([[row[f"in_rate_{c}_deg_s"] for c in "xyz"] for row in table])
    ended = np.array([row["final_rate_deg_s"] for row in table])
    assert np.all(ended < np.linalg.norm(began, axis=1) + 0.01) and np.all(ended > 0.0)

    assert run(["sweep", "my_cube:make", "--case", "4", "--out", "r"]) == 0
    case = json.loads(Path("r/case-4/case.json").read_text())
    assert case["inputs"]["in_rate_y_deg_s"]["value"] == table[4]["in_rate_y_deg_s"]
    assert case["metrics"]["final_rate_deg_s"]["value"] == table[4]["final_rate_deg_s"]
    rows = Path("r/case-4/history.csv").read_text().splitlines()
    assert len(rows) == 37 and rows[0].startswith("t_s,rate_x_deg_s")
    # The history is that case: its last rate is the metric, but for the last digits of another program.
    last = dict(zip(rows[0].split(","), map(float, rows[-1].split(",")), strict=True))
    rate = np.linalg.norm([last[f"rate_{c}_deg_s"] for c in "xyz"])
    assert rate == pytest.approx(table[4]["final_rate_deg_s"], rel=1e-9)
    assert Path("r/case-4/history.png").stat().st_size > 10_000

    assert run(["sensitivity", "my_cube.py", "--cases", "500", "--seed", "2", "--out", "s", "-q", *short]) == 0
    slopes = json.loads(Path("s/slopes.json").read_text())
    assert list(slopes["knobs"]) == ["gain", "largest"] and slopes["knobs"]["largest"]["value"] == 0.2
    # Of cases as those of the sweep; more gain or larger coils: more is spent.
    mean = np.mean([row["coils_A_m2_s"] for row in table])
    assert slopes["metrics"]["coils_A_m2_s"]["mean"] == pytest.approx(mean, rel=0.5)
    spent = slopes["metrics"]["coils_A_m2_s"]["slopes"]
    assert spent["gain"]["slope"] > 0.0 and spent["largest"]["slope"] >= 0.0


def test_the_file_is_found_by_path_and_by_name_and_in_shards(tmp_path, monkeypatch):
    Path("dart.py").write_text(DART)
    assert run(["sweep", "dart.py", *FEW, "--out", "a"]) == 0
    assert run(["sweep", "dart:make", *FEW, "--out", "b"]) == 0
    monkeypatch.chdir(Path("a"))
    for part in ("1/2", "2/2"):
        assert run(["sweep", "../dart.py", *FEW, "--out", str(tmp_path / "c"), "--shard", part]) == 0
    tables = [(tmp_path / name / "cases.parquet").read_bytes() for name in "abc"]
    assert tables[0] == tables[1] == tables[2]


def test_a_sweep_knows_the_code_it_was_begun_with(capsys):
    Path("dart.py").write_text(DART)
    assert run(["sweep", "dart.py", *FEW, "--out", "a"]) == 0
    elsewhere = Source.of("dart.py", {})
    Path("dart.py").write_text(DART.replace("miss < 1.0", "miss < 2.0"))
    for more in (["--resume"], ["--case", "3"]):
        assert run(["sweep", "dart.py", *more, "--out", "a"]) == 1
        expected = "a: holds a sweep with other code of its scenario, whose file has changed since; take another --out"
        assert expected in capsys.readouterr().err
    # As a worker of a cluster would that comes too late.
    with pytest.raises(CodeError, match="has changed since the sweep began"):
        elsewhere.scenario()
    assert run(["sweep", "dart.py", *FEW, "--out", "b"]) == 0


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("def build(options):", "def build(options:", "dart.py:12: SyntaxError: "),
        ("import numpy as np", "import numpyy as np", "dart.py:3: ModuleNotFoundError: No module named 'numpyy'"),
        ("1.0, 0, 1)", "1.0, 0, 1 / 0)", "dart.py:17: ZeroDivisionError: division by zero"),
        ("default_rng([seed", "default_rng([sed", "dart.py:9: NameError: name 'sed' is not defined"),
        ("lambda drawn: drawn", "lambda drawn: drawn.x", "dart.py:19: AttributeError: 'numpy.ndarray' object has no"),
        ("make = Factory", "made = Factory", "dart.py: defines no make"),
        ('"miss_deg": miss}', '"mist_deg": miss}', "scenario dart returned ['mist_deg', 'status'], expected"),
        ('("hit", "missed")', '("hit", "hit")', "dart.py:21: ValueError: Scenario dart: statuses must be"),
    ],
)
def test_errors_in_the_file_are_one_line_that_names_it(old, new, expected, capsys):
    assert old in DART
    Path("dart.py").write_text(DART.replace(old, new))
    assert run(["sweep", "dart.py", *FEW, "--out", "a"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith(f"jaxsat: error: {expected}"), lines
    # What is mended runs, in the same place.
    Path("dart.py").write_text(DART)
    assert run(["sweep", "dart.py", *FEW, "--out", "a"]) == 0


def test_verbose_has_the_traceback(capsys):
    Path("dart.py").write_text(DART.replace("1.0, 0, 1)", "1.0, 0, 1 / 0)"))
    assert run(["sweep", "dart.py", "-v", "--cases", "20", "--out", "a"]) == 1
    err = capsys.readouterr().err
    assert (
        "Traceback" in err and err.splitlines()[-1] == "jaxsat: error: dart.py:17: ZeroDivisionError: division by zero"
    )


@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["nothing.py"], 1, "nothing.py: No such file or directory; jaxsat sweep --new nothing.py writes one"),
        (["dart"], 2, "Did you mean dart.py?"),
        (["dart.py", "--set", "spread=1"], 2, "did you mean spread_deg?"),
        (["dart.py", "--set", "spread_deg=-1"], 2, "spread_deg: expected a number of at least 0, found '-1'"),
        (["dart.py", "--new", "b.py"], 2, "it goes without a scenario"),
        (["--new", "b.txt"], 1, "b.txt: expected a name of a module"),
    ],
)
def test_wrong_words_are_one_line(arguments, status, expected, capsys):
    Path("dart.py").write_text(DART)
    assert run(["sweep", *arguments]) == status
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and expected in captured.err, captured.err
