"""fit.json of any satellite says what a fit found, in the words and units of its channels."""

import json
from dataclasses import replace

import numpy as np
import pytest
from made_up_fit import EPOCH, channel, make_fit_result

from fitting.outcome.result import Cause
from fitting.report.fit.document import fit_document


@pytest.fixture
def document(fit_result, table_session):
    found, nulls = fit_document(fit_result, telemetry="pass.csv", epoch=EPOCH, rejections=table_session.rejections)
    assert nulls == []
    return json.loads(json.dumps(found, allow_nan=False))


def test_causes_stand_as_they_were_ranked():
    causes = (
        Cause("axes", "+X and -X exchanged", "columns are exchanged", 4264.4, 196.6, 1, True, "columns = [...]"),
        Cause("drift", "the scale drifts", "fit shorter arcs", 4264.4, 3900.0, 1, False),
    )
    found, _ = fit_document(make_fit_result(causes=causes), telemetry="pass.csv", epoch=EPOCH)
    assert [cause["kind"] for cause in found["causes"]] == ["axes", "drift"]
    assert found["causes"][0]["explains"] and found["causes"][0]["chi2_after"] == 196.6
    assert tuple(Cause(**each) for each in found["causes"]) == causes


def test_keys_are_those_that_other_programs_rely_on(document):
    assert document["schema"] == "jaxsat.fit/1" and document["telemetry"] == "pass.csv"
    assert document["epoch_utc"] == "2024-03-01T12:00:00.000" and document["status"] == "converged"
    assert document["residual_rms"]["mag"] == {"value": pytest.approx(306.0), "unit": "nT"}
    assert document["residual_rms_mA"] == pytest.approx(4.08)
    assert document["parameters"]["magnet.x"] == {"value": 0.3049, "sigma": 0.0012, "unit": "A m2", "free": True}
    assert document["parameters"]["inertia.xx"]["sigma"] is None
    assert document["gauge"] == "|magnet| held at the nominal value"
    assert document["correlations"]["magnet.x"]["mag.bias.x"] == -0.95
    assert set(document["timing_s"]) == {"import", "prepare", "compile", "solve", "total"}
    attitude = document["attitude"]
    assert {len(attitude[key]) for key in attitude} == {240}
    assert np.shape(attitude["quaternion_inertial_from_body"]) == (240, 4)


def test_verdict_has_its_word_first_and_the_remarks_last(document):
    assert document["verdict"][0] == "predicts" and document["verdict"][1].startswith("one motion explains")
    assert document["verdict"][2:] == ["2 of 80 samples of mag left out as outliers or in doubtful light"]


def test_holdout_stands_beside_what_was_promised(document):
    held = document["holdout"]["mag"]
    assert held["rms"] == pytest.approx(480.0) and held["promised_rms"] == pytest.approx(450.0)
    assert held["sigma_ratio"] == pytest.approx(480.0 / 450.0) and held["unit"] == "nT" and held["angle_deg"] == 0.9


def test_axes_breaks_delays_worth_and_rejections(document):
    assert document["axes"] == {"mag": ["+x", "-z", "+y"]}
    assert document["alternatives"][0]["axes"] == {"mag": ["+y", "-z", "-x"]}
    assert document["breaks"] == [
        {
            "channel": "mag",
            "unit": "nT",
            "breaks": [{"t_s": 300.0, "turn_deg": 4.0, "bias": 1500.0, "saving": 190.0, "left": []}],
        }
    ]
    assert document["delays"]["mag"] == {"value": 0.9, "sigma": 0.05, "unit": "s", "from": "residuals"}
    assert document["delays"]["gyro"] == {"value": 0.21, "sigma": 0.02, "unit": "s", "from": "fit"}
    assert document["buys"] == {"magnet": 54321.0, "mag.bias": 77.7, "gyro.delay": 0.01}
    assert document["rejections"] == {"out of range": 2, "unreadable time": 1}
    mag = document["channels"]["mag"]
    assert mag["samples"] == mag["samples_fitted"] + mag["samples_left_out"] + mag["samples_held_out"] == 120
    assert mag["samples_left_out"] == 2 and mag["samples_held_out"] == 40


def test_nothing_held_out_and_no_panels():
    whole = channel("mag", "Magnetometer", "nT", ("bx", "by", "bz"), 5, 3e4, 1)
    whole = replace(whole, fitted=np.ones(len(whole.t_s), bool), holdout=None)
    fields = {"channels": {"mag": whole}, "field_angle_deg": None, "field_angle_sigma_deg": None}
    found, _ = fit_document(make_fit_result(**fields), telemetry="a", epoch=EPOCH)
    assert found["holdout"] is None and "residual_rms_mA" not in found
    assert found["attitude"]["field_angle_deg"] is None


def test_an_unknown_sigma_is_null():
    blind = np.full((240, 3), np.inf)
    found, nulls = fit_document(make_fit_result(attitude_sigma_deg=blind), telemetry="a", epoch=EPOCH)
    assert nulls == ["attitude.attitude_sigma_deg"] and found["attitude"]["attitude_sigma_deg"][0] == [None] * 3


def test_diagnostics_are_by_channel_and_column(document):
    found = document["diagnostics"]
    assert found["chi2_per_dof"] == pytest.approx(812.5 / 790) and 0.0 < found["chi2_p"] < 1.0
    assert list(found["channels"]) == ["mag", "gyro", "star", "a/b cells"]
    assert list(found["channels"]["star"]["columns"]) == ["turn x", "turn y", "turn z"]
    mag = found["channels"]["mag"]
    # 80 samples were fitted; two were left out, one has no reading.
    assert {column["count"] for column in mag["columns"].values()} == {77}
    assert all(0.7 < column["rms"] < 1.3 for column in mag["columns"].values())
    # Of 231 normal residuals 4.55 % lie beyond 2 sigma, 0.27 % beyond 3.
    assert mag["tails"]["2"]["expected"] == pytest.approx(10.51, abs=0.01)
    assert mag["tails"]["3"]["expected"] == pytest.approx(0.62, abs=0.01) and mag["tails"]["4"]["found"] == 0


def test_what_the_data_hardly_see_is_told(document):
    (direction,) = document["unseen"]
    assert direction["blind"] and direction["components"] == {"magnet.x": 0.01} and document["profiles"] == {}
