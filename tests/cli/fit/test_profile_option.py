"""`jaxsat fit --profile`: what it asks of the fit, what it leaves in the directory, and how it says no."""

import json
from pathlib import Path

import numpy as np
import pytest

from fitting.profile.profile import Profile
from jaxsat.cli.main import run

VALUES = np.linspace(247.0, 255.0, 9)
RISE = 0.5 * ((VALUES - 251.0) / 1.3) ** 2
IMAX = Profile(
    name="imax",
    unit="mA",
    best=251.0,
    sigma=1.3,
    values=VALUES,
    rise=RISE,
    rise_data=RISE - 0.01 * (VALUES - 251.0),
    settled=np.ones(9, bool),
    interval_68=(249.7, 252.3),
    interval_95=(248.45, None),
)


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def asked(monkeypatch, fit_result):
    """A fit and profiles that only look so; returns the list of what was asked of the profiles."""
    calls = []

    def fit(observations, nominal, settings, *, progress, at_minimum):
        at_minimum("problem", "parameters", "refined")
        return fit_result

    def profile_all(problem, parameters, refined, names, *, tail, progress):
        calls.append((problem, parameters, refined, names, tail))
        return ([IMAX], ["rods.y has no profile"]) if names else ([], [])

    monkeypatch.setattr("fitting.run.estimate", fit)

    monkeypatch.setattr("fitting.profile.profiler.profile_all", profile_all)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    return calls


@pytest.mark.slow
def test_profiles_are_in_every_output(asked, capsys):
    assert run(["fit", "--profile", "imax", "--profile", "rods.y", "--out", "out"]) == 0
    assert asked == [("problem", "parameters", "refined", ("imax", "rods.y"), 1e15)]
    assert Path("out/profile-imax.png").read_bytes().startswith(b"\x89PNG")
    document = json.loads(Path("out/fit.json").read_text())
    assert list(document["profiles"]) == ["imax"]
    entry = document["profiles"]["imax"]
    assert entry["values"] == VALUES.tolist() and entry["interval_68"] == [249.7, 252.3]
    assert entry["interval_95"] == [248.45, None] and entry["settled"] == [True] * 9
    page = Path("out/report.html").read_text()
    assert "<h2>Profiles</h2>" in page and "<h2>Profile of imax</h2>" in page and "249.7 ... 252.3" in page
    assert "248.4 ... open" in page or "248.5 ... open" in page
    assert "warning: rods.y has no profile" in capsys.readouterr().err


@pytest.mark.slow
def test_pictures_of_an_earlier_run_go(asked):
    assert run(["fit", "--profile", "imax", "--out", "out"]) == 0
    assert run(["fit", "--out", "out", "--no-plots"]) == 0
    assert not Path("out/profile-imax.png").exists()
    assert json.loads(Path("out/fit.json").read_text())["profiles"] == {}
    assert "<h2>Profile" not in Path("out/report.html").read_text()


@pytest.mark.slow
def test_diagnostics_are_in_every_fit(asked, fit_result):
    assert run(["fit", "--out", "out", "--no-plots"]) == 0
    diagnostics = json.loads(Path("out/fit.json").read_text())["diagnostics"]
    assert list(diagnostics["panels"]) == ["+x", "-x", "+y", "-y", "+z", "-z"]
    used = fit_result.weight[:, 0] > 0
    sigma = np.hypot(2.0, 1.0 / np.sqrt(12.0))
    rms = np.sqrt(np.mean((fit_result.measured_mA - fit_result.modelled_mA)[used, 0] ** 2)) / sigma
    assert diagnostics["panels"]["+x"]["rms"] == pytest.approx(rms)
    assert "<h2>Residual diagnostics</h2>" in Path("out/report.html").read_text()


@pytest.mark.parametrize("name", ["imaxx", "magnet", "state", ""])
def test_no_single_parameter_is_a_usage_error(name, capsys):
    assert run(["fit", "--profile", name]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "is no single parameter such as imax or attitude.x" in error


def test_a_parameter_that_is_not_free_is_bad_input_before_the_work(asked, tmp_path, capsys):
    assert run(["fit", "--free", "state", "--profile", "imax", "--out", "out"]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("jaxsat: error: ") and "imax is not free in this fit and has no profile" in error
    assert asked == [] and list(tmp_path.iterdir()) == []
