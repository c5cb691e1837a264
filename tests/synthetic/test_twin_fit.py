"""Twin experiments: what `simulate` drew is found again, and a sensor of one's own goes all the way with no edit."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from twin_files import MODULE, OWN, PHOTODIODES, SATELLITE

from fitting.sensed_run import fit_table
from fitting.sensed_settings import SensedSettings
from jaxsat.cli.main import run
from jaxsat.files.units import parsed_unit
from jaxsat.satellites import read_satellite
from jaxsat.synthetic.sensed import TwinSettings, make_twin, write_twin
from jaxsat.telemetry import read_telemetry

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


def test_truth_is_found_again(tmp_path):
    (tmp_path / "small.sat.toml").write_text(SATELLITE + PHOTODIODES)
    settings = TwinSettings(duration_s=595.0, every_s=5.0, seed=11)
    write_twin(tmp_path, make_twin(read_satellite(tmp_path / "small.sat.toml"), settings), plots=False)
    satellite = read_satellite(tmp_path / "small.sat.toml")
    session = read_telemetry(tmp_path / "small.csv", satellite)
    result = fit_table(satellite, session, SensedSettings(holdout=0.25)).result
    document = json.loads((tmp_path / "small.truth.json").read_text())
    assert (result.status, result.verdict) == ("converged", "predicts") and len(result.t_s) == 120
    free = {each.name: (each.value, each.sigma, each.unit) for each in result.parameters if each.free}
    found = off(free, document["parameters"])
    wanted = {"inertia.xx", "inertia.yz", "magnet.x", "mag.bias.y", "gyro.bias.z", "sun.gain.+x", "sun.gain.-z"}
    assert wanted <= found.keys()
    assert max(map(abs, found.values())) < SIGMAS, found
    # Three numbers of an attitude: one angle in a million is beyond 5.5 of the largest of their sigmas.
    apart = apart_deg(result.t_s, result.quaternion_inertial_from_body, document)
    assert np.all(apart < 5.5 * result.attitude_sigma_deg.max(axis=1))
    # Nor are the numbers sure because nothing is said of them.
    assert np.median(result.attitude_sigma_deg[result.fitted]) < 0.3


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
