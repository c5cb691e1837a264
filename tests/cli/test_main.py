"""The command line from outside: quick help, exit statuses, one line for each mistake, nothing left behind."""

import fnmatch
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from jaxsat.bundled import BUNDLED
from jaxsat.cli import main
from jaxsat.cli.main import run
from jaxsat.cli.shared.folders import default_folder

ROOT = Path(__file__).parents[2]
HEAVY = ("jax", "matplotlib", "scipy", "numpy", "pydantic", "equinox", "erfa")


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["fit", "--help"],
        ["local", "--help"],
        ["turn", "--help"],
        ["fit", "--stars", "4"],
        ["--version"],
        ["completion", "bash"],
    ],
)
def test_help_and_usage_errors_import_nothing_heavy(arguments):
    script = f"import sys; from jaxsat.cli.main import run; run({arguments!r}); print({{*{HEAVY}}} & {{*sys.modules}})"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "set()"


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["fti"], 'Did you mean "fit"?'),
        (["fit", "--stars", "4"], "Did you mean --starts?"),
        (["fit", "--free", "magnets"], "did you mean magnet?"),
        (["fit", "--free", ""], "expected any of state, inertia, magnet,"),
        (["fit", "--free", "magnet,magnet.azimuth"], "both as a vector and by"),
        (["fit", "--starts", "0"], "Must be >= 1"),
        (["fit", "--seed", "1.5"], "Expected a whole number, got 1.5"),
        (["fit", "--arc", "5"], "--arc"),
        (["fit", "--holdout", "30"], "a share from 0 to 0.9, as 0.3, got 30; 30 % are 0.3"),
        (["fit", "--arc", "5", "1"], "first before the second"),
        (["fit", "--arc", "0", "inf"], "first before the second"),
        (["fit", "--drop", "1", "2", "--drop", "4", "3"], "first before the second"),
    ],
)
def test_usage_error_is_one_line_and_status_2(arguments, expected, capsys):
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    assert captured.err.startswith("jaxsat: error: ") and expected in captured.err


@pytest.mark.parametrize(("status", "expected"), [("converged", 0), ("not_converged", 3), ("ambiguous", 3)])
def test_status_of_a_fit(status, expected, fake_fit, capsys):
    fake_fit["status"] = status
    assert run(["fit", "--out", "deep/out", "--no-plots"]) == expected
    captured = capsys.readouterr()
    assert "bundled synthetic session" in captured.err and "synthetic" in captured.out
    document = json.loads(Path("deep/out/fit.json").read_text())
    assert document["status"] == status and "synthetic" in document["telemetry"]
    assert max(map(len, captured.out.splitlines())) <= 80
    assert sorted(p.name for p in Path("deep").iterdir()) == ["out"]


def test_non_finite_numbers_are_announced(fake_fit, capsys):
    run(["fit", "--no-plots"])
    assert "warning: parameters.imax.sigma is not a finite number" in capsys.readouterr().err


@pytest.mark.parametrize("error", [KeyboardInterrupt(), SystemExit(143)])
def test_a_stopped_fit_leaves_nothing(error, fake_fit, tmp_path):
    fake_fit["error"] = error
    if isinstance(error, SystemExit):
        with pytest.raises(SystemExit):
            run(["fit", "--out", "deep/out"])
    else:
        assert run(["fit", "--out", "deep/out"]) == 130
    assert list(tmp_path.iterdir()) == []


def test_bad_input_is_one_line_status_1_and_leaves_nothing(fake_fit, tmp_path, capsys):
    bad = tmp_path / "bad.RAW_SUN"
    bad.write_text("")
    assert run(["fit", str(bad), "--out", "out"]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1 and str(bad) in captured.err
    assert [p.name for p in tmp_path.iterdir()] == ["bad.RAW_SUN"]


def test_results_that_cannot_be_written_are_bad_input(fake_fit, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert run(["fit", "--out", "file"]) == 1
    assert run(["fit", "--out", "file/below"]) == 1
    assert "expected a directory" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "mine"


def test_a_full_disk_is_one_line_and_leaves_nothing(fake_fit, tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(28, "No space left on device", "attitude.csv")

    monkeypatch.setattr("fitting.report.fit.files.write_attitude", full)
    assert run(["fit", "--no-plots"]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == "jaxsat: error: attitude.csv: No space left on device"
    assert list(tmp_path.iterdir()) == []


def test_one_bad_file_does_not_stop_the_others(fake_fit, tmp_path):
    bad = tmp_path / "bad.RAW_SUN"
    bad.write_text("MUNIN\n")
    assert run(["fit", str(BUNDLED), str(bad), str(BUNDLED), "--out", "all", "--no-plots"]) == 1
    summary = json.loads(Path("all/summary.json").read_text())
    assert summary["schema"] == "jaxsat.fit-summary/1"
    assert summary["counts"] == {"converged": 2, "ambiguous": 0, "not_converged": 0, "failed": 1}
    assert [f["directory"] for f in summary["files"]] == ["b-specular50", None, "b-specular50-2"]
    assert "bad.RAW_SUN" in summary["files"][1]["message"]
    assert sorted(p.name for p in Path("all").iterdir()) == ["b-specular50", "b-specular50-2", "summary.json"]
    assert Path("all/b-specular50-2/fit.json").exists()


def test_a_defect_in_one_of_several_files_is_its_own_failure(fake_fit):
    fake_fit["error"] = ZeroDivisionError("division by zero")
    assert run(["fit", str(BUNDLED), str(BUNDLED), "--out", "all"]) == 1
    summary = json.loads(Path("all/summary.json").read_text())
    assert "unexpected ZeroDivisionError" in summary["files"][0]["message"]


def test_prepare_writes_what_it_says(capsys):
    assert run(["prepare", "--drop", "0", "100", "--out", "prepared", "--no-plots"]) == 0
    document = json.loads(Path("prepared/prepare.json").read_text())
    assert document["schema"] == "jaxsat.prepare/1" and document["samples"] == 69
    reasons = {rejection["reason"] for rejection in document["rejections"]}
    assert any("by hand" in reason for reason in reasons)
    printed = " ".join(capsys.readouterr().out.split())
    assert "left out by hand" in printed and "semi major axis" in printed


def test_config_prints_a_template_that_can_be_read_back(capsys):
    import tomllib

    assert run(["config"]) == 0
    assert {"cleaning", "fit"} <= set(tomllib.loads(capsys.readouterr().out))


def test_every_folder_with_a_command_is_one_and_says_what_it_does(capsys):
    folders = {file.parent.name for file in Path(main.__file__).parent.glob("*/command.py")}
    assert run(["--help"]) == 0
    listed = re.findall(r"^│ (\w+) +(\w.*?) *│$", capsys.readouterr().out, flags=re.MULTILINE)
    assert {name for name, _ in listed} == folders and all(len(meaning) > 10 for _, meaning in listed)


def test_default_folders_are_ignored_by_git(capsys):
    ignored = [line.strip("/\n ") for line in (ROOT / ".gitignore").read_text().splitlines()]
    for name in ("almanac", "export", "fit", "local", "orbit", "prepare", "simulate", "sweep", "turn"):
        assert run([name, "--help"]) == 0
        told = " ".join(capsys.readouterr().out.replace("│", " ").split())
        assert f"[default: {default_folder(name)}]" in told
        assert any(fnmatch.fnmatch(str(default_folder(name)), pattern) for pattern in ignored)
