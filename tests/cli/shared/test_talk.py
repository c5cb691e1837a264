"""`--quiet`, `--verbose` and `--json`: what stands on stdout and what on stderr."""

import json
import subprocess
from pathlib import Path

import pytest

from jaxsat.bundled import BUNDLED
from jaxsat.cli.main import run


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def said(capsys, *arguments: str) -> tuple[str, str]:
    assert run(arguments) == 0
    captured = capsys.readouterr()
    return captured.out, captured.err


def test_json_is_the_file_of_the_results_and_nothing_else(fake_fit, capsys):
    out, err = said(capsys, "fit", "--no-plots", "--out", "a", "--json")
    assert json.loads(out)["schema"] == "jaxsat.fit/1" and out == Path("a/fit.json").read_text()
    assert "no file given" in err and "writing results" in err
    out, _ = said(capsys, "fit", str(BUNDLED), str(BUNDLED), "--no-plots", "--out", "b", "--json")
    assert json.loads(out)["schema"] == "jaxsat.fit-summary/1" and out == Path("b/summary.json").read_text()
    out, err = said(capsys, "almanac", "2001-01-18", "--out", "c", "--json", "-q")
    assert json.loads(out)["schema"] == "jaxsat.almanac/1" and err == ""


def test_quiet_says_nothing_but_warnings(fake_fit, capsys):
    out, err = said(capsys, "fit", "--no-plots", "-q")
    assert out == "" and err.count("\n") == 1 and "warning: parameters.imax.sigma is not a finite number" in err


def test_verbose_says_versions_and_cuts_nothing(fake_fit, capsys):
    usual = said(capsys, "fit", "--no-plots", "--out", "a")
    verbose = said(capsys, "fit", "--no-plots", "--out", "a", "-v")
    assert "python 3." in verbose[1] and "python 3." not in usual[1]
    assert len(verbose[0].splitlines()) >= len(usual[0].splitlines())


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_commands_and_options(shell, capsys):
    script, _ = said(capsys, "completion", shell)
    assert "jaxsat" in script and "satellite" in script
    if shell == "bash":
        # Asked for what begins with `fi` and, of `fit`, with `--sat`.
        ask = "COMP_CWORD=$(({}-1)); COMP_WORDS=({}); _jaxsat; echo ${{COMPREPLY[@]}}\n"
        script += ask.format(2, "jaxsat fi") + ask.format(3, "jaxsat fit --sat")
        done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
        assert done.stdout.split() == ["fit", "--satellite"] and done.stderr == ""
