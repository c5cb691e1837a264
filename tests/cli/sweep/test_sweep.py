"""`jaxsat sweep` from outside: the same table whatever happens on the way, one line for each mistake."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from jaxsat.cli.main import run
from jaxsat.cli.sweep.progress import SweepProgress, duration_text, rate_text
from jaxsat.cli.sweep.scenarios import SCENARIOS, address_of
from jaxsat.sweep.source import factory

FOLDER = Path(__file__).parents[2] / "sweep"
FAKE = "fake_scenario:make"
KEYS = {"schema", "scenario", "cases", "seed", "succeeded", "failed", "metrics", "timing_s", "cases_per_s"}


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(FOLDER)
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda *_: None)


def start(*arguments: str) -> subprocess.Popen:
    """The command in a process of its own."""
    path = os.pathsep.join([str(FOLDER), os.environ.get("PYTHONPATH", "")])
    # Without JAX, which the scenario does not need and which would take most of the time.
    script = "import jaxsat.numerics as n; n.set_up_jax = lambda: None; import jaxsat.cli.main as m; m.main()"
    command = [sys.executable, "-c", script, "sweep", FAKE, "--no-plots", *arguments]
    return subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def whole(*arguments: str) -> bytes:
    """cases.parquet of a sweep that nothing disturbed."""
    assert run(["sweep", FAKE, "--no-plots", "--out", "whole", *arguments]) == 0
    return Path("whole/cases.parquet").read_bytes()


def chunks(out: str) -> list[str]:
    return sorted(path.name for path in Path(out, "chunks").glob("chunk-*.parquet"))


def test_what_a_sweep_leaves(capsys):
    assert run(["sweep", FAKE, "--cases", "50", "--seed", "3", "--set", "scale=2", "--out", "deep/out"]) == 0
    summary = json.loads(Path("deep/out/summary.json").read_text())
    assert KEYS <= set(summary) and summary["schema"] == "jaxsat.sweep/1"
    assert (summary["scenario"], summary["cases"], summary["seed"]) == ("fake", 50, 3)
    assert summary["options"]["scale"] == 2 and summary["cases_per_s"] > 0
    assert (summary["chunk"], summary["precision"], summary["devices"]) == (8, "float64", {"cpu": 7})
    table = pq.read_table("deep/out/cases.parquet")
    assert summary["failed"] == np.flatnonzero(np.array(table["status"].to_pylist()) != "succeeded").tolist() != []
    assert summary["metrics"]["miss_deg"]["p50"] == np.median(table["miss_deg"].to_numpy())
    assert sorted(path.name for path in Path("deep/out").iterdir()) == [
        "cases.parquet",
        "chunks",
        "distributions.png",
        "summary.json",
        "sweep.html",
        "sweep.json",
    ]
    captured = capsys.readouterr()
    assert max(map(len, captured.out.splitlines())) <= 80
    assert "too slow" in captured.out and "settling_time_s" in captured.out and "50 of 50 cases" in captured.err


def test_a_finished_sweep_can_be_resumed_and_grown(capsys):
    expected = whole("--cases", "50", "--seed", "3")
    arguments = ["sweep", FAKE, "--no-plots", "--out", "a"]
    # As a queue does that gives every job the same line.
    assert run([*arguments, "--cases", "20", "--seed", "3", "--resume"]) == 0
    assert "a holds no sweep yet: beginning it" in capsys.readouterr().err
    rate = json.loads(Path("a/summary.json").read_text())["cases_per_s"]
    assert run([*arguments, "--resume"]) == 0
    again = json.loads(Path("a/summary.json").read_text())
    assert again["cases"] == 20 and again["cases_per_s"] == rate
    assert run([*arguments, "--cases", "50", "--resume"]) == 0
    assert Path("a/cases.parquet").read_bytes() == expected
    assert "2 of 7 chunks are there already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ([], "out: holds a sweep already; --resume finishes it"),
        (["--resume", "--seed", "4"], "out: holds a sweep with seed 3, not 4"),
        (["--resume", "--set", "scale=2"], "out: holds a sweep with option scale = 1, not 2"),
        (["--resume", "--cases", "9"], "out: holds a sweep with 20 cases, not 9"),
        (["--resume", "--precision", "float32"], "out: holds a sweep with precision float64, not float32"),
        (["--resume", "--chunk", "16"], "out: holds a sweep with cases of a chunk 8, not 16"),
        (["--case", "1", "--seed", "4"], "out: holds a sweep with seed 3, not 4"),
    ],
)
def test_another_sweep_in_the_directory_is_refused(arguments, expected, capsys):
    first = ["sweep", FAKE, "--no-plots", "--out", "out"]
    assert run([*first, "--cases", "20", "--seed", "3"]) == 0
    capsys.readouterr()
    before = sorted((path, path.read_bytes()) for path in Path("out").rglob("*") if path.is_file())
    assert run([*first, *arguments]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and expected in captured.err
    assert sorted((path, path.read_bytes()) for path in Path("out").rglob("*") if path.is_file()) == before


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["gravity-gradiant"], "Did you mean gravity-gradient?"),
        (["zzz"], "Known: "),
        (["nowhere_at_all:make"], "nowhere_at_all:make: cannot be imported"),
        ([FAKE, "--set", "scal=1"], "did you mean scale?"),
        ([FAKE, "--set", "scale=-1"], "scale: expected a number of at least 0, found '-1'"),
        ([FAKE, "--set", "scale"], "Expected NAME=VALUE"),
        ([FAKE, "--set", "scale=1", "--set", "scale=2"], "scale is set more than once"),
        ([FAKE, "--shard", "0/2"], "Expected I/N with I from 1 to N"),
        ([FAKE, "--shard", "3/2"], "Expected I/N"),
        ([FAKE, "--shard", "1"], "Expected I/N"),
        ([FAKE, "--cases", "0"], "Must be >= 1"),
        ([FAKE, "--cases", "1e3"], "Expected a whole number"),
        ([FAKE, "--case", "-1"], "Must be >= 0"),
        ([FAKE, "--case", "1", "--shard", "1/2"], "--case runs one case"),
        ([FAKE, "--chunk", "12"], "--chunk: expected a multiple of 8 for fake, got 12"),
        ([FAKE, "--precision", "float16"], "float16"),
        (["fake_scenario:fine", "--precision", "float32"], "fake runs in float64 alone: it is too fine"),
        ([FAKE, "--engine", "ray"], "ray"),
        ([FAKE, "--scheduler", "tcp://a:1"], "--engine dask"),
    ],
)
def test_usage_error_is_one_line_and_status_2(arguments, expected, tmp_path, capsys):
    assert run(["sweep", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and expected in captured.err, captured.err
    assert list(tmp_path.iterdir()) == []


def test_without_a_scenario_all_are_listed(capsys):
    assert run(["sweep"]) == 0
    printed = capsys.readouterr().out
    for name, entry in SCENARIOS.items():
        assert name in printed
        assert all(option.name in printed for option in factory(entry.address).options)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_in_the_table_can_be_made(name):
    assert factory(address_of(name))({}).name == name


def test_a_spoilt_chunk_is_named_and_run_again(capsys):
    expected = whole("--cases", "50")
    spoilt = Path("whole/chunks/chunk-00000002.parquet")
    spoilt.write_bytes(b"PAR1")
    assert run(["sweep", FAKE, "--no-plots", "--out", "whole", "--resume"]) == 0
    assert f"warning: {spoilt}: cannot be read" in capsys.readouterr().err
    assert Path("whole/cases.parquet").read_bytes() == expected


def test_chunks_of_another_size_and_another_device(monkeypatch, capsys):
    """A GPU takes many cases at once, and a CPU may finish what it began, with a word."""
    expected = whole("--cases", "50")
    arguments = ["sweep", FAKE, "--no-plots", "--out", "a"]
    with monkeypatch.context() as patched:
        for module in ("numerics", "sweep.chunks"):
            patched.setattr(f"jaxsat.{module}.device_name", lambda: "gpu H")
        patched.setattr("jaxsat.cli.sweep.request.GPU_CASES", 20)
        assert run([*arguments, "--cases", "50", "--shard", "1/2"]) == 0
    assert chunks("a") == ["chunk-00000000.parquet", "chunk-00000002.parquet"]
    capsys.readouterr()
    assert run([*arguments, "--resume"]) == 0
    assert "warning: begun with device gpu H: last digits may differ" in capsys.readouterr().err
    summary = json.loads(Path("a/summary.json").read_text())
    assert summary["chunk"] == 24 and summary["devices"] == {"gpu H": 2, "cpu": 1}
    assert Path("a/cases.parquet").read_bytes() == expected


def test_a_full_disk_is_one_line(tmp_path, capsys):
    assert run(["sweep", "fake_scenario:broken"]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == "jaxsat: error: somewhere: No space left on device"


@pytest.mark.slow
def test_killed_at_random_moments_and_resumed():
    """SIGKILL, again and again: nothing is lost and nothing is there twice."""
    expected = whole("--cases", "200", "--seed", "7", "--set", "pause_s=0.05")
    arguments = ["--cases", "200", "--seed", "7", "--set", "pause_s=0.05", "--out", "killed", "--workers", "2"]
    rng = random.Random(1)
    for resume in ([], ["--resume"]):
        before, process = len(chunks("killed")), start(*arguments, *resume)
        while len(chunks("killed")) < before + 3 and process.poll() is None:
            time.sleep(0.01)
        time.sleep(0.1 * rng.random())
        process.send_signal(signal.SIGKILL)
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert not Path("killed/cases.parquet").exists() and before + 3 <= len(chunks("killed")) < 25
    out, err = (last := start("--out", "killed", "--resume")).communicate()
    assert last.returncode == 0, err
    assert "200 cases" in out
    assert Path("killed/cases.parquet").read_bytes() == expected
    assert chunks("killed") == chunks("whole") and len(chunks("whole")) == 25
    assert not list(Path("killed").rglob("*.part"))


def test_interrupted_with_a_word_how_to_resume():
    process = start("--cases", "400", "--set", "pause_s=0.05", "--out", "a dir")
    while not chunks("a dir") and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130
    said = re.fullmatch(
        rf"jaxsat: error: interrupted; (\d+) of 50 chunks are kept; "
        rf"resume with: jaxsat sweep {FAKE} --out 'a dir' --resume",
        err.splitlines()[-1],
    )
    # A thread that was just being started may finish its chunk after the line.
    assert said and int(said[1]) <= len(chunks("a dir")) <= int(said[1]) + 1 < 50


@pytest.mark.slow
def test_two_shards_at_once():
    settings = ["--cases", "100", "--seed", "5", "--set", "pause_s=0.01"]
    expected = whole(*settings)
    both = [start(*settings, "--out", "parts", "--shard", f"{part}/2") for part in (1, 2)]
    printed = [process.communicate() for process in both]
    assert [process.returncode for process in both] == [0, 0], printed
    assert any("results in parts" in out for out, _ in printed)
    assert Path("parts/cases.parquet").read_bytes() == expected
    assert json.loads(Path("parts/summary.json").read_text())["cases"] == 100


def test_a_shard_alone_says_what_is_missing(capsys):
    arguments = ["sweep", FAKE, "--no-plots", "--cases", "40", "--out", "parts"]
    assert run([*arguments, "--shard", "2/2"]) == 0
    assert "3 of 5 chunks are still missing" in capsys.readouterr().err
    assert not Path("parts/cases.parquet").exists()
    assert run([*arguments, "--resume"]) == 0
    assert Path("parts/cases.parquet").read_bytes() == whole("--cases", "40")


def test_one_case_is_that_of_the_sweep(capsys):
    whole("--cases", "20", "--seed", "3")
    assert run(["sweep", FAKE, "--out", "whole", "--case", "13"]) == 0
    found = json.loads(Path("whole/case-13/case.json").read_text())
    table = pq.read_table("whole/cases.parquet").to_pylist()[13]
    assert found["schema"] == "jaxsat.sweep-case/1" and found["seed"] == 3 and found["status"] == table["status"]
    assert found["metrics"]["miss_deg"] == {"value": table["miss_deg"], "unit": "deg"}
    assert found["inputs"]["in_push_y_m_s"] == {"value": table["in_push_y_m_s"], "unit": "m/s"}
    assert run(["sweep", FAKE, "--out", "alone", "--seed", "3", "--case", "13"]) == 0
    assert json.loads(Path("alone/case-13/case.json").read_text()) == found


def test_progress_in_a_log_is_a_line_a_tenth(capsys):
    with SweepProgress("a", 100) as progress:
        for number in range(50):
            progress(2, number % 2)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "a: 100 cases to run" and len(lines) == 11
    assert lines[-1].startswith("a: 100 of 100 cases, ") and lines[-1].endswith("0 s left, 25 failed")


def test_rates_and_times_as_text():
    assert [rate_text(x) for x in (0.25, 279.04, 123456.0)] == ["0.25 cases/s", "279 cases/s", "123456 cases/s"]
    assert [duration_text(x) for x in (42.2, 200.0, 18720.0)] == ["42 s", "3 min 20 s", "5 h 12 min"]
