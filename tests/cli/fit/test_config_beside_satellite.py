"""`--config` beside `--satellite`: settings of the fit reach it, numbers of Munin are refused in words."""

import pytest

from jaxsat.bundled import BUNDLED, MUNIN_SATELLITE
from jaxsat.cli.main import run
from jaxsat.errors import InputError

MUNIN = ["fit", str(BUNDLED), "--satellite", str(MUNIN_SATELLITE), "--out", "out", "--config", "own.toml"]


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """What reaches the fit of a configuration, and of options beside it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    found = []

    def fit(satellite, session, *, settings, given, **_):
        found.append((settings, given))
        raise InputError("enough")

    monkeypatch.setattr("fitting.run.fit", fit)

    def ask(text: str, *options: str):
        (tmp_path / "own.toml").write_text(text)
        return run([*MUNIN, *options]), found

    return ask


def test_settings_and_what_is_given_reach_the_fit(asked):
    text = '[fit]\nstep_s = 8.0\nmax_rate_deg_s = 6.0\nfree = "magnet, imax"\n[earth]\nradius_km = 6371.0\n'
    status, ((settings, given),) = asked(text, "--starts", "16")
    assert (settings.step_s, settings.max_rate_deg_s, settings.starts) == (8.0, 6.0, 16)
    assert settings.free == ("magnet", "imax") and given.earth.radius_km == 6371.0 and status == 1


@pytest.mark.parametrize(
    ("text", "status", "reason"),
    [
        ("[spacecraft]\n", 1, "own.toml: spacecraft: belongs to Munin; beside --satellite a file may hold [orbit]"),
        ("[fit]\nnoise_mA = 2.0\n", 1, "own.toml: fit.noise_mA: unknown key"),
        ("[fit]\nholdout = 30\n", 1, "own.toml: fit.holdout: "),
        ('[fit]\nfree = "magnets"\n', 1, "own.toml: fit.free: unknown"),
    ],
)
def test_what_is_not_of_a_fit_is_refused_with_its_key(asked, text, status, reason, capsys):
    assert asked(text) == (status, [])
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and reason in error
