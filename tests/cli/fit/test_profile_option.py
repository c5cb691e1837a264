"""`jaxsat fit --profile`: what it asks of the fit, and how it says no before the work."""

import pytest

from jaxsat.bundled import BUNDLED, MUNIN_SATELLITE
from jaxsat.cli.main import run
from jaxsat.errors import InputError

MUNIN = ["fit", str(BUNDLED), "--satellite", str(MUNIN_SATELLITE), "--out", "out"]


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def test_the_names_reach_the_fit(monkeypatch):
    asked = []

    def fit(satellite, session, *, profiles, **_):
        asked.append(profiles)
        raise InputError("enough")

    monkeypatch.setattr("fitting.run.fit", fit)
    assert run([*MUNIN, "--profile", "imax", "--profile", "rate.x"]) == 1
    assert run(MUNIN) == 1
    assert [list(names) for names in asked] == [["imax", "rate.x"], []]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--profile", "imaxx"], "unknown parameter 'imaxx'; did you mean imax?"),
        (["--profile", "magnet"], "unknown parameter 'magnet'; did you mean magnet.x?"),
        (["--profile", "gains"], "unknown parameter 'gains'; did you mean gains.+x?"),
        (["--profile", ""], "unknown parameter ''"),
        # As the satellite's file has it, whose aliases are other words for the same.
        (
            ["--free", "state", "--profile", "imax"],
            "imax is not free in this fit and has no profile; free are att",
        ),
    ],
)
@pytest.mark.parametrize("command", [MUNIN, ["fit", "--out", "out"]], ids=["satellite", "RAW_SUN"])
def test_what_has_no_profile_is_wrong_usage_before_a_file_is_read(
    command, options, reason, tmp_path, monkeypatch, capsys
):
    def fit_one(*_, **__):
        raise AssertionError("the work has begun")

    monkeypatch.setattr("jaxsat.cli.fit.one.fit_one", fit_one)
    assert run([*command, *options]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("jaxsat: error: Invalid value for --profile: ") and reason in error
    assert list(tmp_path.iterdir()) == []
