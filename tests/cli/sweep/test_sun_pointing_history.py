"""`jaxsat sweep sun-pointing` from the command line: what it writes of all cases and of one."""

import csv
import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.cli.main import run

OPTIONS = ["--set", "estimator=published", "--set", "time_s=700", "--set", "max_rate_deg_s=1"]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    directory = tmp_path_factory.mktemp("sweep") / "out"
    assert run(["sweep", "sun-pointing", "--cases", "40", "--seed", "4", "--out", str(directory), *OPTIONS]) == 0
    return directory


@pytest.mark.slow
def test_cases_end_pointing_and_their_times_add_up(swept):
    table = pq.read_table(swept / "cases.parquet").to_pydict()
    assert table["case"] == list(range(40))
    settled = np.array(table["settling_time_s"], float)
    good = np.array([status == "succeeded" for status in table["status"]])
    # Half of the cases begin with the Sun behind them: not all of these have settled after 700 s.
    assert good.sum() > 30 and np.all(np.isfinite(settled[good]))
    spent = np.sum([table[f"{mode}_time_s"] for mode in ("damping", "search", "slew")], axis=0)
    # And the hold time of 100 s, but for where the Sun was let go of and found again.
    assert np.median(settled[good] - spent[good]) == pytest.approx(100.0, abs=2.0)
    assert np.max(np.array(table["final_error_deg"])[good]) < 1.0
    assert np.max(table["worst_estimate_deg"]) > 30.0
    summary = json.loads((swept / "summary.json").read_text())
    assert summary["schema"] == "jaxsat.sweep/1" and summary["options"]["estimator"] == "published"
    assert summary["succeeded"] == good.sum() and len(summary["failed"]) == 40 - good.sum()


@pytest.mark.slow
def test_one_case_again_with_its_history(swept):
    assert run(["sweep", "sun-pointing", "--case", "7", "--out", str(swept)]) == 0
    found = json.loads((swept / "case-7" / "case.json").read_text())
    table = pq.read_table(swept / "cases.parquet").to_pydict()
    for name, metric in found["metrics"].items():
        assert metric["value"] == table[name][7], name
    with (swept / "case-7" / "history.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 700 and float(rows[-1]["t_s"]) == 699.0
    assert float(rows[-1]["impulse_N_s"]) == pytest.approx(table["impulse_N_s"][7], rel=0.02)
    assert float(rows[0]["view_angle_deg"]) > float(rows[-1]["view_angle_deg"])
    assert (swept / "case-7" / "history.png").read_bytes()[:4] == b"\x89PNG"
    # What it was drawn from is how it begins.
    drawn = {name: one["value"] for name, one in found["inputs"].items()}
    assert all(value == table[name][7] for name, value in drawn.items())
    for c in "xyz":
        assert float(rows[0][f"rate_{c}_deg_s"]) == pytest.approx(drawn[f"in_rate_{c}_deg_s"], abs=1e-9)
    attitude = Rotation.from_quat([drawn[f"in_attitude_{c}"] for c in "wxyz"], scalar_first=True)
    # The sensor's axis is -z of the body, the Sun along x of the inertial axes.
    view_angle = np.degrees(np.arccos(-attitude.inv().apply([1.0, 0.0, 0.0])[2]))
    assert float(rows[0]["view_angle_deg"]) == pytest.approx(view_angle, abs=1e-6)


@pytest.mark.parametrize(
    ("option", "words"),
    [("estimator=best", "tracking, filter, published"), ("inertia=2", "from 0 to 0.2"), ("inertias=0.1", "inertia")],
)
def test_a_wrong_option_is_one_line(option, words, tmp_path, capsys):
    assert run(["sweep", "sun-pointing", "--set", option, "--out", str(tmp_path / "out")]) in (1, 2)
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and words in error
    assert not (tmp_path / "out").exists()
