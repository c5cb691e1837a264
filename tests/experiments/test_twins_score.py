"""The judge of the study of twins: what is at the truth, what is silent, and errors in the units of a fit."""

import copy
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

# Last, so that an installed jaxsat is the one under test.
sys.path.append(str(Path(__file__).parents[2]))

from experiments.twins.draw import draw
from experiments.twins.picture import picture
from experiments.twins.score import axes_found, errors_over_sigma, score, summary

T = np.arange(0.0, 11.0)


def turning(t):
    return Rotation.from_rotvec(np.outer(t, [0.0, 0.0, 0.1])).as_quat(scalar_first=True)


@pytest.fixture
def truth():
    fine = np.arange(0.0, 12.0, 0.5)
    return {
        "name": "kind-1",
        "epoch_utc": "2020-11-21T20:58:01",
        "t": T.tolist(),
        "q": turning(T).tolist(),
        "fine": {"t": fine.tolist(), "q": turning(fine).tolist()},
        "parameters": {
            "mag.bias.x": {"value": 2e-6, "unit": "T"},
            "sun.limit": {"value": np.pi / 2.0, "unit": "rad"},
            "rate.z": {"value": 0.1, "unit": "rad/s"},
        },
        "sensors": {"mag": {"axes": ["+y", "-x", "+z"]}},
    }


@pytest.fixture
def fit():
    """One second after the truth's epoch, one degree about body x, two after seven tenths of the time."""
    t = T[:-1]
    error = np.where(t <= 6.3, 1.0, 2.0)
    turn = Rotation.from_rotvec(np.radians(np.outer(error, [1.0, 0.0, 0.0])))
    found = Rotation.from_quat(turning(t + 1.0), scalar_first=True) * turn
    numbers = {"free": True, "note": ""}
    return {
        "epoch_utc": "2020-11-21T20:58:02.000",
        "status": "converged",
        "attitude": {
            "t_s": t.tolist(),
            "quaternion_inertial_from_body": found.as_quat(scalar_first=True).tolist(),
            "attitude_sigma_deg": np.full((10, 3), 0.5).tolist(),
        },
        "parameters": {
            "mag.bias.x": {"value": 2.5, "sigma": 0.25, "unit": "uT", **numbers},
            "sun.limit": {"value": 88.0, "sigma": 2.0, "unit": "deg", **numbers},
            "rate.z": {"value": 0.0, "sigma": 1e-9, "unit": "deg/s", **numbers},
            "mass": {"value": 1.0, "sigma": None, "unit": "kg", **numbers},
        },
        "axes": {"mag": ["+y", "-x", "+z"]},
        "alternatives": [],
    }


def test_errors_are_small_turns_at_the_samples(fit, truth):
    row = score(fit, truth, holdout=0.3)
    assert row["attitude_deg"] == pytest.approx(1.0) and row["held_out_deg"] == pytest.approx(2.0)
    assert row["sigma_deg"] == pytest.approx(0.5 * np.sqrt(3.0))
    assert row["attitude_z"] == pytest.approx(2.0 / np.sqrt(3.0))
    assert row["reached"] and row["within_sigmas"] and not row["silent"] and row["axes"] == "found"


def test_z_is_counted_in_the_units_of_the_fit(fit, truth):
    assert errors_over_sigma(fit, truth) == {"mag.bias.x": pytest.approx(2.0), "sun.limit": pytest.approx(-1.0)}


def test_a_wrong_motion_or_wrong_axes_of_a_converged_fit_are_silent(fit, truth):
    wrong = copy.deepcopy(fit)
    wrong["attitude"]["quaternion_inertial_from_body"] = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (10, 4)).tolist()
    row = score(wrong, truth)
    assert not row["reached"] and row["silent"]
    assert not score(wrong | {"status": "ambiguous"}, truth)["silent"]
    other = fit | {"axes": {"mag": ["+x", "+y", "+z"]}}
    assert score(other, truth)["silent"] and axes_found(other, truth) == "wrong"
    listed = other | {"alternatives": [{"axes": {"mag": ["+y", "-x", "+z"]}}], "status": "ambiguous"}
    assert axes_found(listed, truth) == "listed"
    assert axes_found({**fit, "axes": {}}, truth) is None


def test_a_study_counts_refusals_and_quotes_z_of_what_is_at_the_truth(fit, truth, tmp_path):
    rows = [score(fit, truth), {"session": "kind-2", "status": "refused", "silent": False}]
    found = summary(rows)
    assert found["sessions"] == 2 and found["reached"] == 1 and found["silent"] == 0
    assert found["z_rms"] == pytest.approx(np.sqrt(2.5)) and found["axes"]["found"] == 1
    assert summary(rows[1:])["z_rms"] is None
    for number, part in enumerate((rows, rows[1:])):
        picture("1u-axes", part, tmp_path / f"{number}.png")
        assert (tmp_path / f"{number}.png").stat().st_size > 10_000


def test_true_values_scatter_as_their_file_says():
    biases = np.array([draw("1u-coils", seed)["sensors"]["mag"]["bias"] for seed in range(40)])
    assert np.std(biases) == pytest.approx(1.5e-6, rel=0.2)
    exact = draw("1u-coils", 1, 0.0)
    assert not np.any(exact["sensors"]["gyro"]["bias"]) and exact["sensors"]["sun"]["gain"] == [1.0] * 6
