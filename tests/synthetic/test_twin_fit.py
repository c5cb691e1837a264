"""Twin experiments: what `simulate` drew is found again, and a sensor of one's own goes all the way with no edit."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from twin_files import MODULE, OWN, SATELLITE

from jaxsat.cli.main import run
from jaxsat.files.units import parsed_unit

pytestmark = pytest.mark.slow

SIGMAS = 3.5
"""Of which one number in two thousand is farther off."""


def off(parameters, truth):
    """How many sigmas each found number, of (value, sigma, unit) by name, is from the true one."""
    found = {}
    for name, (value, sigma, unit) in parameters.items():
        if sigma is not None and np.isfinite(sigma) and name in truth:
            factor = parsed_unit(unit).factor
            found[name] = (value * factor - truth[name]["value"]) / (sigma * factor)
    return found


def apart_deg(t_s, q, document):
    """Angles [deg] from the true attitudes, at times that are among the true ones."""
    places = np.searchsorted(document["t"], np.asarray(t_s) - 1e-6)
    true = Rotation.from_quat(np.array(document["q"])[places], scalar_first=True)
    return np.degrees((Rotation.from_quat(np.asarray(q), scalar_first=True).inv() * true).magnitude())


def test_a_sensor_of_five_lines_goes_all_the_way(tmp_path, capsys):
    """By the commands alone: simulate, check, fit with its report; its module lies beside the satellite file."""
    (tmp_path / "small.sat.toml").write_text(SATELLITE + OWN)
    (tmp_path / "mycells.py").write_text(MODULE)
    twin, fit = tmp_path / "twin", tmp_path / "fit"
    words = ["simulate", "--satellite", str(tmp_path / "small.sat.toml"), "--duration", "595", "--seed", "3"]
    assert run([*words, "--no-plots", "--out", str(twin)]) == 0
    assert (twin / "mycells.py").read_text() == MODULE
    session = [str(twin / "small.csv"), "--satellite", str(twin / "small.sat.toml")]
    assert run(["check", *session, "--out", str(tmp_path / "check")]) == 0
    assert "cells: 120 readings" in capsys.readouterr().out
    assert run(["fit", *session, "--holdout", "0.25", "--out", str(fit)]) == 0
    assert "cells.peak" in capsys.readouterr().out
    document, truth = (json.loads(path.read_text()) for path in (fit / "fit.json", twin / "small.truth.json"))
    free = {
        name: (each["value"], each["sigma"], each["unit"])
        for name, each in document["parameters"].items()
        if each["free"]
    }
    found = off(free, truth["parameters"])
    assert "cells.peak" in found and max(map(abs, found.values())) < SIGMAS, found
    # What the gyroscope and the magnetometer alone leave to 5 % is known to a thousandth or two.
    assert free["cells.peak"][1] < 0.005
    assert document["holdout"]["cells"]["sigma_ratio"] < 1.5
    page = (fit / "report.html").read_text()
    assert "MyCells" in page or "cells.peak" in page
    assert (fit / "channel-cells.csv").is_file() and (fit / "channel-cells.png").is_file()
    # Read back, its sigmas are its own; the module of its sensor runs only where the satellite file is named.
    assert run(["sensitivity", str(fit), "--out", str(tmp_path / "limits"), "--no-plots"]) == 1
    assert "give --satellite" in capsys.readouterr().err
    words = ["sensitivity", str(fit), "--satellite", str(twin / "small.sat.toml"), "--out", str(tmp_path / "limits")]
    assert run([*words, "--no-plots"]) == 0
    limits = json.loads((tmp_path / "limits" / "sensitivity.json").read_text())["parameters"]
    for name, (_, sigma, _) in free.items():
        # The hold-out is not counted in either.
        assert limits[name]["sigma"] == pytest.approx(sigma, rel=1e-3), name
