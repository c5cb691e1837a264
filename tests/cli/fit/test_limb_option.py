"""`jaxsat fit --limb`: what reaches the fit, what it leaves in the directory, and how it says no."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from jaxsat.bundled import BUNDLED
from jaxsat.cli.fit.inputs import OfRawSun
from jaxsat.cli.main import run
from jaxsat.cli.settings.files import load_config

SESSION = BUNDLED.with_name("a-nominal-exact.RAW_SUN")
HEADER = "utc,distance_deg,turn_deg"
ROWS = ["2001-01-18T04:54:15,10,-20", "2001-01-18T04:55:19.2,11,", "2001-01-18T04:56:23,,30"]
STRAY = "2001-01-18T04:54:40,1,2"


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def write(*rows) -> Path:
    path = Path("limb.csv")
    path.write_text("\n".join([HEADER, *rows, ""]))
    return path


@pytest.mark.slow
def test_results_tell_of_the_limb_angles(fake_fit, capsys):
    path = write(*ROWS, STRAY)
    assert run(["fit", str(SESSION), "--limb", str(path), "--out", "out", "--no-plots"]) == 0
    provenance = json.loads(Path("out/provenance.json").read_text())
    assert provenance["paths"] == [str(SESSION), "limb.csv"]
    assert provenance["sha256"][1] == hashlib.sha256(path.read_bytes()).hexdigest()
    page = Path("out/report.html").read_text()
    assert provenance["sha256"][1] in page
    warning = "limb.csv: 1 of 4 rows with limb angles are not used"
    assert f"jaxsat: warning: {warning}" in capsys.readouterr().err and warning in page
    assert any(warning in each for each in provenance["warnings"])


@pytest.mark.slow
def test_weight_zero_does_not_look_at_the_file(fake_fit, capsys):
    """As with `vesABlimb` = 0, under which the file may be missing."""
    Path("off.toml").write_text("[fit]\nlimb_weight = 0.0\n")
    arguments = ["fit", str(SESSION), "--config", "off.toml", "--limb", "none.csv", "--out", "out", "--no-plots"]
    assert run(arguments) == 0
    assert "none.csv: limb angles are not used, for fit.limb_weight is 0" in capsys.readouterr().err


def test_angles_reach_the_fit_at_their_samples():
    config = load_config(None, {"fit.limb_weight": 0.25})
    inputs = OfRawSun.by(config, write(*ROWS), None, None)([SESSION])
    limb = inputs.session.channels["limb"]
    np.testing.assert_allclose(limb.t_s, [0.0, 64.0, 128.0])
    np.testing.assert_allclose(np.degrees(limb.values), [[10.0, -20.0], [11.0, np.nan], [np.nan, 30.0]])
    # A weight is a factor of the inverse variance.
    assert np.degrees(limb.sigma) == pytest.approx(0.5 / np.sqrt(0.25))


def test_one_file_of_angles_is_of_one_session(capsys, tmp_path):
    assert run(["fit", str(SESSION), str(BUNDLED), "--limb", "limb.csv", "--out", "out"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "--limb holds the angles of one session, but 2 files are given" in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("2001-01-18T04:54:15,x,2", "limb.csv:2: distance_deg: expected a plain decimal number"),
        (STRAY, "limb.csv: utc: none of 1 rows lies within 0.5 s of a sample"),
    ],
)
def test_bad_file_is_one_line_and_leaves_nothing(row, expected, fake_fit, capsys, tmp_path):
    write(row)
    assert run(["fit", str(SESSION), "--limb", "limb.csv", "--out", "out"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and error.startswith(f"jaxsat: error: {expected}")
    assert [path.name for path in tmp_path.iterdir()] == ["limb.csv"]


def test_weights_and_sigmas_have_their_limits(capsys):
    for key in ("limb_sigma_deg = 0.0", "limb_weight = -1.0", "limb_sigma_deg = inf"):
        Path("bad.toml").write_text(f"[fit]\n{key}\n")
        assert run(["fit", str(SESSION), "--config", "bad.toml", "--out", "out"]) == 1
        assert f"fit.{key.split()[0]}" in capsys.readouterr().err
