"""fit.json key by key, tables of numbers, and a directory that appears whole or not at all."""

import csv
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from made_up_munin import make_munin_result

from fitting.outcome.result import FitResult
from fitting.report.fit.document import fit_document
from fitting.report.fit.tables import ATTITUDE_COLUMNS, write_attitude, write_channel
from jaxsat.errors import InputError
from jaxsat.files.json_files import json_text
from jaxsat.files.staging import staged_directory
from jaxsat.time import Epoch

EPOCH = Epoch.from_utc(2001, 1, 18, 4, 54, 15.0)


@pytest.fixture(scope="module")
def made() -> FitResult:
    return make_munin_result(12)


@pytest.fixture(scope="module")
def document(made):
    content, nulls = fit_document(made, telemetry="a.RAW_SUN", epoch=EPOCH)
    assert nulls == ["parameters.imax.sigma"]
    return json.loads(json_text(content), parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def test_fit_json_has_the_keys_of_its_schema_and_no_others(document, made):
    assert list(document) == [
        *("schema", "telemetry", "epoch_utc", "status", "message", "verdict", "chi2", "dof", "residual_rms_mA"),
        *("residual_rms", "holdout", "witness", "parameters", "gauge", "unseen", "buys", "correlations", "axes"),
        *("alternatives", "causes", "delays", "breaks", "channels", "rejections", "attitude", "diagnostics"),
        *("profiles", "timing_s"),
    ]
    assert document["schema"] == "jaxsat.fit/1"
    assert document["telemetry"] == "a.RAW_SUN"
    assert document["epoch_utc"] == "2001-01-18T04:54:15.000"
    assert (document["status"], document["message"]) == ("converged", "best of 8 starts")
    assert (document["chi2"], document["dof"], document["residual_rms_mA"]) == (101.5, 92, 2.05)
    assert isinstance(document["dof"], int)
    assert document["parameters"] == {
        "magnet.x": {"value": 0.3049, "sigma": 0.0012, "unit": "A m2", "free": True},
        "imax": {"value": 251.4, "sigma": None, "unit": "mA", "free": True},
        "gains.+x": {"value": 1.0, "sigma": None, "unit": "1", "free": False},
    }
    assert document["gauge"] == "|magnet| held"
    assert document["correlations"]["magnet.x"] == {"imax": -0.95}
    assert list(document["timing_s"]) == ["import", "prepare", "compile", "solve", "total"]
    assert document["witness"]["mag"]["confirms"] is True
    attitude = document["attitude"]
    assert list(attitude) == [
        *("t_s", "quaternion_inertial_from_body", "angular_velocity_rad_s", "attitude_sigma_deg"),
        *("field_angle_deg", "field_angle_sigma_deg", "fitted"),
    ]
    for name in attitude:
        np.testing.assert_array_equal(attitude[name], getattr(made, name))


def test_json_refuses_what_is_not_finite():
    with pytest.raises(ValueError):
        json_text({"chi2": math.nan})


def test_csv_files_have_their_columns(made, tmp_path):
    write_attitude(tmp_path / "attitude.csv", made, EPOCH)
    columns = write_channel(tmp_path / "cells.csv", made.channels["cells"], EPOCH)
    for name, expected in (("attitude.csv", ATTITUDE_COLUMNS), ("cells.csv", columns)):
        with (tmp_path / name).open(newline="") as stream:
            rows = list(csv.DictReader(stream))
        assert list(rows[0]) == list(expected) and len(rows) == made.t_s.size
        assert rows[1]["t_s"] == "64" and rows[1]["utc"] == "2001-01-18T04:55:19.000"
    attitude = np.genfromtxt(tmp_path / "attitude.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    np.testing.assert_allclose(attitude["q_z"], made.quaternion_inertial_from_body[:, 3], rtol=1e-9)


def names(directory: Path) -> list[str]:
    return sorted(entry.name for entry in directory.iterdir())


def test_directory_is_whole(tmp_path):
    with staged_directory(tmp_path / "a" / "out") as stage:
        (stage / "fit.json").write_text("new")
        assert not (tmp_path / "a" / "out").exists()
    assert names(tmp_path / "a") == ["out"] and names(tmp_path / "a" / "out") == ["fit.json"]
    assert (tmp_path / "a" / "out").stat().st_mode & 0o777 == 0o777 & ~_umask()


def test_failing_writer_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError), staged_directory(tmp_path / "a" / "b" / "out") as stage:
        (stage / "fit.json").write_text("half")
        raise RuntimeError
    assert names(tmp_path) == []


def test_existing_directory_keeps_foreign_files_and_loses_old_results(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for name in ("fit.json", "currents.png", "notes.txt"):
        (out / name).write_text("old")
    with staged_directory(out, owned=("fit.json", "currents.png")) as stage:
        (stage / "fit.json").write_text("new")
    assert names(out) == ["fit.json", "notes.txt"] and names(tmp_path) == ["out"]
    assert (out / "fit.json").read_text() == "new"


def test_failing_writer_leaves_an_existing_directory_as_it_was(tmp_path):
    (tmp_path / "fit.json").write_text("old")
    with pytest.raises(RuntimeError), staged_directory(tmp_path) as stage:
        (stage / "fit.json").write_text("half")
        raise RuntimeError
    assert names(tmp_path) == ["fit.json"] and (tmp_path / "fit.json").read_text() == "old"


def test_failure_while_moving_puts_everything_back(tmp_path, monkeypatch):
    out = tmp_path / "out"
    # With a folder of the user's the directory stays itself, and files are moved one by one.
    (out / "folder").mkdir(parents=True)
    (out / "a").write_text("old a")
    rename = Path.rename

    def failing(self, target):
        if Path(target) == out / "b":
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(InputError, match="No space left"), staged_directory(out) as stage:
        (stage / "a").write_text("new a")
        (stage / "b").write_text("new b")
    assert names(out) == ["a", "folder"] and (out / "a").read_text() == "old a" and names(tmp_path) == ["out"]


def test_file_in_the_way_is_said_before_any_work(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(InputError, match="is a file"), staged_directory(tmp_path / "out"):
        pytest.fail("entered")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
