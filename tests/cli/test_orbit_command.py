"""`jaxsat orbit`: elements of the bundled session, doubtful points, and what it refuses."""

import json
import math

import jax
import numpy as np
import pytest

from fitting.orbit.orbit_fit import fit_without_doubtful
from jaxsat.bundled import BUNDLED
from jaxsat.cli.main import run
from jaxsat.environment import KeplerOrbit

TRUTH = {"semi_major_axis": 7630026.457, "eccentricity": 0.072661, "inclination": math.radians(95.438873)}


@pytest.fixture(autouse=True)
def in_an_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def test_elements_of_a_session_with_three_wrong_rows(capsys):
    lines = BUNDLED.read_text().splitlines()
    for k in (10, 50, 90):
        fields = lines[k].split()
        fields[12] = str(float(fields[12]) + 30.0)
        lines[k] = " ".join(fields)
    with open("wrong.RAW_SUN", "w") as stream:
        stream.write("\n".join(lines) + "\n")
    assert run(["orbit", "wrong.RAW_SUN", "--average", "mean", "--out", "out", "--no-plots"]) == 0
    with open("out/orbit.json") as stream:
        document = json.load(stream)
    assert document["schema"] == "jaxsat.orbit/1" and document["status"] == "converged"
    for name, true in TRUTH.items():
        element = document["elements"][name]
        assert abs(element["value"] - true) < 4.0 * element["sigma"], name
    assert abs(document["time_of_perigee_s"] - 3230.533197) < 1.0
    rms, all_rms = (d["position_residual_rms_m"] for d in (document, document["all_positions"]))
    # Positions are wrong by 300 m a row, and up to three rows make a sample.
    assert 180.0 < rms["after"] < rms["before"] < 260.0 < 800.0 < all_rms["after"] < all_rms["before"]
    with open("out/residuals.csv") as stream:
        rows = [line.split(",") for line in stream.read().splitlines()]
    assert rows[0][-1] == "doubtful" and sum(row[-1] == "1" for row in rows) == len(document["doubtful_t_s"]) == 3
    printed = capsys.readouterr().out
    assert "semi major axis" in printed and "without 3 doubtful ones" in printed


def test_doubtful_points_spoil_the_average_but_not_what_is_kept():
    rng = np.random.default_rng(1)
    orbit = KeplerOrbit(7.6e6, 0.07, 1.66, 1.1, 0.3, 0.2)
    t = np.arange(0.0, 4500.0, 64.0)
    position, velocity = map(np.array, jax.jit(jax.vmap(orbit))(t))
    position += rng.normal(scale=100.0, size=position.shape)
    position[[5, 40]] += 30e3
    everything, kept = fit_without_doubtful(t, position, velocity, average=np.mean)
    assert kept.outlier[[5, 40]].all() and kept.outlier.sum() == 2 and not everything.outlier.any()
    assert everything.rms_before_m > 1.5 * kept.rms_before_m
    assert kept.rms_after_m == pytest.approx(100.0, rel=0.15)
    assert abs(kept.elements["semi_major_axis"] - 7.6e6) < 4 * kept.sigma["semi_major_axis"]
    np.testing.assert_allclose(np.linalg.norm(kept.residual_after_m[[5, 40]], axis=1), 30e3 * np.sqrt(3), rtol=0.02)


@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["no.RAW_SUN"], 1, "no such file"),
        ([str(BUNDLED), "--doubtful", "1"], 2, "2 sigmas or more"),
        ([str(BUNDLED), "--doubtful", "nan"], 2, "2 sigmas or more"),
        ([str(BUNDLED), "--average", "mode"], 2, "--average"),
        ([str(BUNDLED), "--drop", "100", "9000"], 1, "positions"),
    ],
)
def test_bad_input_is_one_line(arguments, status, expected, capsys):
    assert run(["orbit", *arguments, "--out", "out"]) == status
    error = capsys.readouterr().err
    assert expected in error and error.count("\n") == 1
